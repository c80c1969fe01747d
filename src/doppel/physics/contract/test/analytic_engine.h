#pragma once
// A small engine for tests: doppel's own inverse dynamics and mass matrix, in many short implicit steps.
// Mimic joints are not constraints but reduced coordinates. It has no contacts and no joint friction.

#include "doppel/physics/contract/engine_modules.h"

namespace doppel::test {

EngineModule analytic_engine();

}  // namespace doppel::test
