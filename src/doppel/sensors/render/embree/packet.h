#pragma once
// Values of all rays of a packet at once: a tile of pixels, as wide as the registers that this module is compiled for.
// Every module computes the same: nothing here is contracted, reordered or approximated by the processor.

#include <Eigen/Core>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "doppel/sensors/render/embree/embree_api.h"

#ifdef __AVX2__
#include <immintrin.h>
#endif

namespace doppel::embree {

#ifdef __AVX512F__
inline constexpr int kTileHeight = 4;
using RayPacket = RTCRay16;
using RayHitPacket = RTCRayHit16;
#else
inline constexpr int kTileHeight = 2;
using RayPacket = RTCRay8;
using RayHitPacket = RTCRayHit8;
#endif
inline constexpr int kTileWidth = 4, kLanes = kTileWidth * kTileHeight;

inline constexpr float kInfinity = std::numeric_limits<float>::infinity();

using Floats = float __attribute__((vector_size(kLanes * sizeof(float))));
using Ints = std::int32_t __attribute__((vector_size(kLanes * sizeof(std::int32_t))));  // masks: -1 is true
struct Floats3 {
  Floats x, y, z;
};

inline Floats load(const float* values) {
  Floats out;
  std::memcpy(&out, values, sizeof out);
  return out;
}
inline Ints load(const unsigned* values) {
  Ints out;
  std::memcpy(&out, values, sizeof out);
  return out;
}
inline void store(Floats value, float* out) {
  std::memcpy(out, &value, sizeof value);
}
inline void store(Ints value, unsigned* out) {
  std::memcpy(out, &value, sizeof value);
}
inline Floats broadcast(float value) {
  return Floats{} + value;
}
inline Floats3 broadcast(const Eigen::Vector3f& v) {
  return {broadcast(v.x()), broadcast(v.y()), broadcast(v.z())};
}

// One bit for each lane of a mask.
inline unsigned bits_of(Ints mask) {
#if defined(__AVX512F__)
  __m512i lanes;
  std::memcpy(&lanes, &mask, sizeof lanes);
  return _mm512_movepi32_mask(lanes);
#elif defined(__AVX2__)
  __m256 lanes;
  std::memcpy(&lanes, &mask, sizeof lanes);
  return static_cast<unsigned>(_mm256_movemask_ps(lanes));
#else
  unsigned bits = 0;
  for (int i = 0; i < kLanes; ++i) bits |= mask[i] != 0 ? 1U << i : 0U;
  return bits;
#endif
}
inline bool any(Ints mask) {
  return bits_of(mask) != 0;
}
// The first lane of a mask with any.
inline int first_of(Ints mask) {
  return std::countr_zero(bits_of(mask));
}
inline unsigned count(Ints mask) {
  return static_cast<unsigned>(std::popcount(bits_of(mask)));
}

inline Floats larger(Floats a, Floats b) {
  return a > b ? a : b;
}
inline Floats smaller(Floats a, Floats b) {
  return a < b ? a : b;
}
inline float smallest(Floats value) {
#ifdef __AVX512F__
  value = smaller(
      value, __builtin_shufflevector(value, value, 8, 9, 10, 11, 12, 13, 14, 15, 0, 1, 2, 3, 4, 5, 6, 7));
  value =
      smaller(value, __builtin_shufflevector(value, value, 4, 5, 6, 7, 0, 1, 2, 3, 4, 5, 6, 7, 0, 1, 2, 3));
#else
  value = smaller(value, __builtin_shufflevector(value, value, 4, 5, 6, 7, 0, 1, 2, 3));
#endif
  return std::min({value[0], value[1], value[2], value[3]});
}
inline Floats root(Floats value) {
  float out[kLanes];
  store(value, out);
  for (float& x : out) x = std::sqrt(x);
  return load(out);
}

inline Floats3 operator+(const Floats3& a, const Floats3& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Floats3 operator-(const Floats3& a, const Floats3& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Floats3 operator*(const Floats3& a, Floats b) {
  return {a.x * b, a.y * b, a.z * b};
}
// R^T v, and R v.
inline Floats3 turned_back(const Eigen::Matrix3f& R, const Floats3& v) {
  return {R(0, 0) * v.x + R(1, 0) * v.y + R(2, 0) * v.z, R(0, 1) * v.x + R(1, 1) * v.y + R(2, 1) * v.z,
          R(0, 2) * v.x + R(1, 2) * v.y + R(2, 2) * v.z};
}
inline Floats3 turned(const Eigen::Matrix3f& R, const Floats3& v) {
  return {R(0, 0) * v.x + R(0, 1) * v.y + R(0, 2) * v.z, R(1, 0) * v.x + R(1, 1) * v.y + R(1, 2) * v.z,
          R(2, 0) * v.x + R(2, 1) * v.y + R(2, 2) * v.z};
}
inline Floats dot(const Floats3& a, const Floats3& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Floats norm(const Floats3& a) {
  return root(dot(a, a));
}
inline Floats3 select(Ints mask, const Floats3& a, const Floats3& b) {
  return {mask ? a.x : b.x, mask ? a.y : b.y, mask ? a.z : b.z};
}

// x^e for x >= 0; below 1e-37 as 1e-37. Relative error: below 2e-7 max(1, |e log2 x|).
inline Floats power(Floats x, Floats e) {
  const Floats at_least = larger(x, broadcast(1e-37F));
  Ints bits;
  std::memcpy(&bits, &at_least, sizeof bits);
  const Ints exponent = (bits - 0x3F3504F3) >> 23;  // so that the mantissa is within sqrt(1/2) and sqrt(2)
  bits -= exponent << 23;
  Floats m;
  std::memcpy(&m, &bits, sizeof m);
  const Floats s = (m - 1.0F) / (m + 1.0F), q = s * s;  // log m = 2 artanh s
  const Floats log2 = __builtin_convertvector(exponent, Floats) +
                      s * (2.88539008F + q * (0.961796694F + q * (0.577078016F + q * 0.412198583F)));
  const Floats y = smaller(larger(e * log2, broadcast(-126.0F)), broadcast(127.0F));
  const Floats whole = (y + 12582912.0F) - 12582912.0F, f = y - whole;  // rounds to the nearest
  const Floats two_to_f =
      1.0F + f * (0.693147181F +
                  f * (0.240226507F + f * (0.0555041087F + f * (9.61812911e-3F +
                                                                f * (1.33335581e-3F + f * 1.54035304e-4F)))));
  const Ints scale = (__builtin_convertvector(whole, Ints) + 127) << 23;
  Floats two_to_whole;
  std::memcpy(&two_to_whole, &scale, sizeof scale);
  return two_to_f * two_to_whole;
}

}  // namespace doppel::embree
