#pragma once
// Eight or sixteen floats at once, as lanes.h has eight doubles: the same bits in every module.

#include "doppel/robot/lanes/kernels/lanes.h"

#ifdef __x86_64__
#include <immintrin.h>
#endif

namespace {

#if defined(__AVX512F__)
inline constexpr int kFloatWidth = 16;
#elif defined(__AVX2__)
inline constexpr int kFloatWidth = 8;
#else
inline constexpr int kFloatWidth = 4;
#endif

template <int L>
struct FloatRegisters {
  static constexpr int kWidthOf = L < kFloatWidth ? L : kFloatWidth;
  static constexpr int kPartsOf = L / kWidthOf;
  typedef float Values __attribute__((vector_size(kWidthOf * sizeof(float))));
  typedef std::int32_t Bits __attribute__((vector_size(kWidthOf * sizeof(float))));
};

template <int L>
struct Floats {
  typename FloatRegisters<L>::Values part[FloatRegisters<L>::kPartsOf];
};
template <int L>
struct FloatMask {
  typename FloatRegisters<L>::Bits part[FloatRegisters<L>::kPartsOf];  // -1: true
};

// Unrolled, so that the parts stay in registers.
#define DOPPEL_EACH_FLOAT_PART _Pragma("GCC unroll 4") for (int i = 0; i < FloatRegisters<L>::kPartsOf; ++i)

template <int L>
DOPPEL_LANES Floats<L> all_floats(float value) {
  Floats<L> out;
  DOPPEL_EACH_FLOAT_PART out.part[i] = typename FloatRegisters<L>::Values{} + value;
  return out;
}
template <int L>
DOPPEL_LANES Floats<L> load_floats(const float* values) {
  Floats<L> out;
  DOPPEL_EACH_FLOAT_PART std::memcpy(&out.part[i], values + i * FloatRegisters<L>::kWidthOf,
                                     sizeof out.part[i]);
  return out;
}
template <int L>
DOPPEL_LANES void store_floats(const Floats<L>& value, float* out) {
  DOPPEL_EACH_FLOAT_PART std::memcpy(out + i * FloatRegisters<L>::kWidthOf, &value.part[i],
                                     sizeof value.part[i]);
}
// Eight doubles, each rounded to the nearest float.
DOPPEL_LANES void narrow(const Lane& value, float* out) {
  using Narrow = float __attribute__((vector_size(kWidth * sizeof(float))));
  DOPPEL_EACH_PART {
    const Narrow part = __builtin_convertvector(value.part[i], Narrow);
    std::memcpy(out + i * kWidth, &part, sizeof part);
  }
}
template <int L>
DOPPEL_LANES Floats<L> operator+(const Floats<L>& a, const Floats<L>& b) {
  Floats<L> out;
  DOPPEL_EACH_FLOAT_PART out.part[i] = a.part[i] + b.part[i];
  return out;
}
template <int L>
DOPPEL_LANES Floats<L> operator-(const Floats<L>& a, const Floats<L>& b) {
  Floats<L> out;
  DOPPEL_EACH_FLOAT_PART out.part[i] = a.part[i] - b.part[i];
  return out;
}
template <int L>
DOPPEL_LANES Floats<L> operator*(const Floats<L>& a, const Floats<L>& b) {
  Floats<L> out;
  DOPPEL_EACH_FLOAT_PART out.part[i] = a.part[i] * b.part[i];
  return out;
}
template <int L>
DOPPEL_LANES Floats<L> operator*(const Floats<L>& a, float b) {
  Floats<L> out;
  DOPPEL_EACH_FLOAT_PART out.part[i] = a.part[i] * b;
  return out;
}
template <int L>
DOPPEL_LANES Floats<L> operator+(const Floats<L>& a, float b) {
  Floats<L> out;
  DOPPEL_EACH_FLOAT_PART out.part[i] = a.part[i] + b;
  return out;
}
template <int L>
DOPPEL_LANES FloatMask<L> operator<=(const Floats<L>& a, const Floats<L>& b) {
  FloatMask<L> out;
  DOPPEL_EACH_FLOAT_PART out.part[i] = a.part[i] <= b.part[i];
  return out;
}
template <int L>
DOPPEL_LANES FloatMask<L> operator|(const FloatMask<L>& a, const FloatMask<L>& b) {
  FloatMask<L> out;
  DOPPEL_EACH_FLOAT_PART out.part[i] = a.part[i] | b.part[i];
  return out;
}
template <int L>
DOPPEL_LANES FloatMask<L> no_lanes() {
  return {};
}
template <int L>
DOPPEL_LANES Floats<L> select(const FloatMask<L>& mask, const Floats<L>& a, const Floats<L>& b) {
  Floats<L> out;
  DOPPEL_EACH_FLOAT_PART out.part[i] = mask.part[i] ? a.part[i] : b.part[i];
  return out;
}
template <int L>
DOPPEL_LANES Floats<L> operator-(const Floats<L>& a) {
  Floats<L> out;
  DOPPEL_EACH_FLOAT_PART out.part[i] = -a.part[i];
  return out;
}
template <int L>
DOPPEL_LANES Floats<L> max_of(const Floats<L>& a, const Floats<L>& b) {
  Floats<L> out;
  DOPPEL_EACH_FLOAT_PART out.part[i] = a.part[i] > b.part[i] ? a.part[i] : b.part[i];
  return out;
}
template <int L>
DOPPEL_LANES Floats<L> size_of_floats(const Floats<L>& a) {
  return max_of(a, -a);
}
template <int L>
DOPPEL_LANES Floats<L> root_of(const Floats<L>& a) {
  float values[L];
  store_floats(a, values);
  for (float& x : values) x = std::sqrt(x);
  return load_floats<L>(values);
}

// The quarter of the circle of eight angles, 0 to 3, and what is left, +-pi/4: for |angle| < 1e5 to 1e-11.
DOPPEL_LANES void reduce_angle(const Lane& angle, float* quarter, float* rest) {
  const Lane turns = rounded(angle * 0.63661977236758134308);
  narrow(angle - turns * 1.57079632679489661923, rest);
  narrow(turns - rounded(turns * 0.25 + -0.375) * 4.0, quarter);
}

// Sine and cosine of a reduced angle to 1.5e-7. Source: Cephes, sinf.c (Moshier 1989).
template <int L>
DOPPEL_LANES void sine_cosine(const Floats<L>& quarter, const Floats<L>& r, Floats<L>& sine,
                              Floats<L>& cosine) {
  const Floats<L> z = r * r;
  Floats<L> s = z * -1.9515295891e-4F + 8.3321608736e-3F;
  s = s * z + -1.6666654611e-1F;
  s = s * z * r + r;
  Floats<L> c = z * 2.443315711809948e-5F + -1.388731625493765e-3F;
  c = c * z + 4.166664568298827e-2F;
  c = c * z * z + (z * -0.5F + 1.0F);
  const Floats<L> half = all_floats<L>(0.5F);
  const FloatMask<L> even = half <= size_of_floats(size_of_floats(quarter + -2.0F) + -1.0F);
  const FloatMask<L> positive_sine = quarter <= all_floats<L>(1.5F);
  const FloatMask<L> positive_cosine = all_floats<L>(1.0F) <= size_of_floats(quarter + -1.5F);
  const Floats<L> sin_part = select(even, s, c), cos_part = select(even, c, s);
  sine = select(positive_sine, sin_part, -sin_part);
  cosine = select(positive_cosine, cos_part, -cos_part);
}

// One bit for each lane.
template <int L>
DOPPEL_LANES std::uint32_t bits_of_floats(const FloatMask<L>& mask) {
  std::uint32_t bits = 0;
#ifdef __x86_64__
  constexpr int kWide = FloatRegisters<L>::kWidthOf;
  DOPPEL_EACH_FLOAT_PART {
    std::uint32_t part = 0;
#ifdef __AVX512F__
    if constexpr (kWide == 16) part = _mm512_movepi32_mask(reinterpret_cast<__m512i>(mask.part[i]));
#endif
#ifdef __AVX2__
    if constexpr (kWide == 8)
      part = static_cast<std::uint32_t>(_mm256_movemask_ps(reinterpret_cast<__m256>(mask.part[i])));
#endif
    if constexpr (kWide == 4)
      part = static_cast<std::uint32_t>(_mm_movemask_ps(reinterpret_cast<__m128>(mask.part[i])));
    bits |= part << (i * kWide);
  }
#else
  std::int32_t lanes[L];
  std::memcpy(lanes, &mask, sizeof lanes);
  for (int i = 0; i < L; ++i) bits |= (lanes[i] != 0 ? 1U : 0U) << i;
#endif
  return bits;
}

}  // namespace
