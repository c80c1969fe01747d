#pragma once
// Reading declared parameters, and the checks that several controllers share.

#include <cmath>
#include <string>
#include <variant>

#include "doppel/ros/bus/parameters.h"

namespace doppel {

// The present value of a declared parameter of type T.
template <class T>
const T& parameter_value(const Parameters& parameters, const std::string& name) {
  return std::get<T>(parameters.find(name)->value);
}

inline Status check_positive(const ParameterValue& value) {
  const double number = std::get<double>(value);
  return number > 0 && std::isfinite(number) ? Status{} : Status::refused("it must be above 0");
}

inline Status check_positive_or_zero(const ParameterValue& value) {
  const double number = std::get<double>(value);
  return number >= 0 && std::isfinite(number) ? Status{} : Status::refused("it must be at least 0");
}

}  // namespace doppel
