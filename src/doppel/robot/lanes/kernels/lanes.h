#pragma once
// Eight numbers at once, in as many registers as the processor that this module is compiled for needs. Every
// module computes the same bits: nothing is contracted, reordered or approximated by the processor.
//
// Nothing here has external linkage, so that no code for one processor is linked into a module for another.

#include <cmath>
#include <cstdint>
#include <cstring>

#define DOPPEL_LANES __attribute__((always_inline)) inline

namespace {

inline constexpr int kLanes = 8;
#if defined(__AVX512F__)
inline constexpr int kWidth = 8;
#elif defined(__AVX2__)
inline constexpr int kWidth = 4;
#else
inline constexpr int kWidth = 2;
#endif
inline constexpr int kParts = kLanes / kWidth;

using Register = double __attribute__((vector_size(kWidth * sizeof(double))));
using MaskRegister = std::int64_t __attribute__((vector_size(kWidth * sizeof(double))));

struct Mask {
  MaskRegister part[kParts];  // -1: true
};
struct Lane {
  Register part[kParts];
};

#define DOPPEL_EACH_PART for (int i = 0; i < kParts; ++i)

DOPPEL_LANES Lane broadcast(double value) {
  Lane out;
  DOPPEL_EACH_PART out.part[i] = Register{} + value;
  return out;
}
DOPPEL_LANES Lane load(const double* values) {
  Lane out;
  std::memcpy(&out, values, sizeof out);
  return out;
}
DOPPEL_LANES void store(const Lane& value, double* out) {
  std::memcpy(out, &value, sizeof value);
}
DOPPEL_LANES Lane operator+(const Lane& a, const Lane& b) {
  Lane out;
  DOPPEL_EACH_PART out.part[i] = a.part[i] + b.part[i];
  return out;
}
DOPPEL_LANES Lane operator-(const Lane& a, const Lane& b) {
  Lane out;
  DOPPEL_EACH_PART out.part[i] = a.part[i] - b.part[i];
  return out;
}
DOPPEL_LANES Lane operator-(const Lane& a) {
  Lane out;
  DOPPEL_EACH_PART out.part[i] = -a.part[i];
  return out;
}
DOPPEL_LANES Lane operator*(const Lane& a, const Lane& b) {
  Lane out;
  DOPPEL_EACH_PART out.part[i] = a.part[i] * b.part[i];
  return out;
}
DOPPEL_LANES Lane operator/(const Lane& a, const Lane& b) {
  Lane out;
  DOPPEL_EACH_PART out.part[i] = a.part[i] / b.part[i];
  return out;
}
DOPPEL_LANES Lane operator*(const Lane& a, double b) {
  Lane out;
  DOPPEL_EACH_PART out.part[i] = a.part[i] * b;
  return out;
}
DOPPEL_LANES Lane operator+(const Lane& a, double b) {
  Lane out;
  DOPPEL_EACH_PART out.part[i] = a.part[i] + b;
  return out;
}
DOPPEL_LANES Mask operator<(const Lane& a, const Lane& b) {
  Mask out;
  DOPPEL_EACH_PART out.part[i] = a.part[i] < b.part[i];
  return out;
}
DOPPEL_LANES Mask operator<=(const Lane& a, const Lane& b) {
  Mask out;
  DOPPEL_EACH_PART out.part[i] = a.part[i] <= b.part[i];
  return out;
}
DOPPEL_LANES Mask operator&(const Mask& a, const Mask& b) {
  Mask out;
  DOPPEL_EACH_PART out.part[i] = a.part[i] & b.part[i];
  return out;
}
DOPPEL_LANES Mask operator|(const Mask& a, const Mask& b) {
  Mask out;
  DOPPEL_EACH_PART out.part[i] = a.part[i] | b.part[i];
  return out;
}
DOPPEL_LANES Mask operator~(const Mask& a) {
  Mask out;
  DOPPEL_EACH_PART out.part[i] = ~a.part[i];
  return out;
}
DOPPEL_LANES Lane select(const Mask& mask, const Lane& a, const Lane& b) {
  Lane out;
  DOPPEL_EACH_PART out.part[i] = mask.part[i] ? a.part[i] : b.part[i];
  return out;
}
DOPPEL_LANES Lane larger(const Lane& a, const Lane& b) {
  Lane out;
  DOPPEL_EACH_PART out.part[i] = a.part[i] > b.part[i] ? a.part[i] : b.part[i];
  return out;
}
DOPPEL_LANES Lane smaller(const Lane& a, const Lane& b) {
  Lane out;
  DOPPEL_EACH_PART out.part[i] = a.part[i] < b.part[i] ? a.part[i] : b.part[i];
  return out;
}
DOPPEL_LANES Lane magnitude(const Lane& a) {
  return larger(a, -a);
}
// One bit for each lane.
DOPPEL_LANES unsigned bits_of(const Mask& mask) {
  std::int64_t lanes[kLanes];
  std::memcpy(lanes, &mask, sizeof lanes);
  unsigned bits = 0;
  for (int i = 0; i < kLanes; ++i) bits |= (lanes[i] != 0 ? 1U : 0U) << i;
  return bits;
}
DOPPEL_LANES Lane root(const Lane& a) {
  double values[kLanes];
  store(a, values);
  for (double& x : values) x = std::sqrt(x);
  return load(values);
}

// To the nearest whole number, for |a| < 2^51.
DOPPEL_LANES Lane rounded(const Lane& a) {
  const Lane magic = broadcast(6755399441055744.0);
  return (a + magic) - magic;
}

// Sine and cosine to 2e-16 for |x| < 1e5. Source: Cephes, sin.c (Moshier 1984): reduction to +-pi/4 by three
// parts of pi/2, then polynomials of degree 13 and 14.
DOPPEL_LANES void sine_cosine(const Lane& x, Lane& sine, Lane& cosine) {
  const Lane turns = rounded(x * 0.63661977236758134308);
  Lane r = x - turns * 1.57079625129699707031;
  r = r - turns * 7.54978941586159635335e-8;
  r = r - turns * 5.39030285815811905475e-15;
  const Lane z = r * r;
  Lane s = z * 1.58962301576546568060e-10 + -2.50507477628578072866e-8;
  s = s * z + 2.75573136213857245213e-6;
  s = s * z + -1.98412698295895385996e-4;
  s = s * z + 8.33333333332211858878e-3;
  s = s * z + -1.66666666666666307295e-1;
  s = r + r * z * s;
  Lane c = z * -1.13585365213876817300e-11 + 2.08757008419747316778e-9;
  c = c * z + -2.75573141792967388112e-7;
  c = c * z + 2.48015872888517045348e-5;
  c = c * z + -1.38888888888730564116e-3;
  c = c * z + 4.16666666666665929218e-2;
  c = broadcast(1.0) - z * 0.5 + z * z * c;
  // The quarter of the circle, 0 to 3: odd ones exchange sine and cosine, the later two change the sign.
  const Lane quarter = turns - rounded(turns * 0.25 + -0.375) * 4.0;
  const Mask odd = magnitude(magnitude(quarter + -2.0) + -1.0) < broadcast(0.5);
  const Mask negative_sine = broadcast(1.5) < quarter;
  const Mask negative_cosine = magnitude(quarter + -1.5) < broadcast(1.0);
  const Lane sin_part = select(odd, c, s), cos_part = select(odd, s, c);
  sine = select(negative_sine, -sin_part, sin_part);
  cosine = select(negative_cosine, -cos_part, cos_part);
}

struct Lane3 {
  Lane x, y, z;
};
DOPPEL_LANES Lane3 operator+(const Lane3& a, const Lane3& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
DOPPEL_LANES Lane3 operator-(const Lane3& a, const Lane3& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
DOPPEL_LANES Lane3 operator*(const Lane3& a, const Lane& b) {
  return {a.x * b, a.y * b, a.z * b};
}
DOPPEL_LANES Lane dot(const Lane3& a, const Lane3& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
DOPPEL_LANES Lane3 cross(const Lane3& a, const Lane3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
DOPPEL_LANES Lane3 select(const Mask& mask, const Lane3& a, const Lane3& b) {
  return {select(mask, a.x, b.x), select(mask, a.y, b.y), select(mask, a.z, b.z)};
}

// A pose as its columns.
struct LanePose {
  Lane3 x, y, z, p;
};

}  // namespace
