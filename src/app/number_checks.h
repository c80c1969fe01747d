#pragma once
// Checks of numbers in options whose messages name the bound that matters; CLI11's own print the largest
// double.

#include <CLI/CLI.hpp>

namespace doppel::app {

CLI::Validator positive_number();
CLI::Validator non_negative_number();

}  // namespace doppel::app
