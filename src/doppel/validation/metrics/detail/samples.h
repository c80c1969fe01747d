#pragma once
// Preconditions of sampled signals, and values between samples.

#include <cstddef>
#include <span>

namespace doppel {

bool all_finite(std::span<const double> values);

// At least `count` samples, equally many of both, all finite, the time strictly rising.
bool is_sampled_signal(std::span<const double> time, std::span<const double> values, std::size_t count);

// Linear between samples; before the first and after the last sample their values. Precondition:
// is_sampled_signal with one sample.
double value_at(std::span<const double> time, std::span<const double> values, double instant);

double mean_of(std::span<const double> values);  // 0 without values

// The sample standard deviation (n - 1); 0 with fewer than two values.
double deviation_of(std::span<const double> values);

}  // namespace doppel
