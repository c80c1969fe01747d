#pragma once
// The Wire library is part of the Arduino.h beside it.
