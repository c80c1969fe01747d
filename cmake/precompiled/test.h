// As library.h, for test programs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "library.h"
