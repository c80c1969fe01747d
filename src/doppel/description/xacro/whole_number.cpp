#include "doppel/description/xacro/detail/whole_number.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace doppel {
namespace {

int digit_of(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  const char small = static_cast<char>(c | 0x20);
  return small >= 'a' && small <= 'z' ? small - 'a' + 10 : 36;
}

}  // namespace

WholeNumber::WholeNumber(bool minus, Limbs limbs) : minus_(minus), limbs_(std::move(limbs)) {
  while (!limbs_.empty() && limbs_.back() == 0) limbs_.pop_back();
  if (limbs_.empty()) minus_ = false;
}

WholeNumber::WholeNumber(std::int64_t value) : minus_(value < 0) {
  auto magnitude = static_cast<std::uint64_t>(value);
  if (minus_) magnitude = 0 - magnitude;
  for (; magnitude != 0; magnitude >>= 32) limbs_.push_back(static_cast<std::uint32_t>(magnitude));
}

WholeNumber::WholeNumber(double value) {
  int exponent = 0;
  const double fraction = std::frexp(std::abs(std::trunc(value)), &exponent);  // 0.5 to 1
  constexpr int kMantissa = 53;
  *this = WholeNumber(static_cast<std::int64_t>(std::ldexp(fraction, std::min(exponent, kMantissa))));
  for (int left = exponent - kMantissa; left > 0; left -= 31)
    multiply_add(std::uint32_t{1} << std::min(left, 31), 0);
  minus_ = value < 0 && !limbs_.empty();
}

std::optional<WholeNumber> WholeNumber::parse(std::string_view digits, int base) {
  WholeNumber out;
  if (digits.empty()) return std::nullopt;
  for (const char c : digits) {
    const int digit = digit_of(c);
    if (digit >= base) return std::nullopt;
    out.multiply_add(static_cast<std::uint32_t>(base), static_cast<std::uint32_t>(digit));
  }
  return out;
}

std::size_t WholeNumber::bits() const {
  return limbs_.empty() ? 0 : 32 * limbs_.size() - static_cast<std::size_t>(std::countl_zero(limbs_.back()));
}

std::optional<std::int64_t> WholeNumber::small() const {
  if (limbs_.size() > 2) return std::nullopt;
  std::uint64_t magnitude = 0;
  for (std::size_t i = limbs_.size(); i-- > 0;) magnitude = magnitude << 32 | limbs_[i];
  constexpr std::uint64_t kLimit = std::uint64_t{1} << 63;
  if (magnitude > kLimit || (magnitude == kLimit && !minus_)) return std::nullopt;
  return static_cast<std::int64_t>(minus_ ? 0 - magnitude : magnitude);
}

// To the nearest, to even at halves: the highest 64 bits, of which the last represents all omitted ones.
double WholeNumber::real() const {
  const std::size_t size = bits();
  std::uint64_t high = 0;
  const std::size_t left_off = size > 64 ? size - 64 : 0;
  bool rest = false;
  for (std::size_t i = 0; i < limbs_.size(); ++i) {
    const std::size_t at = 32 * i;
    if (at + 32 <= left_off) {
      rest = rest || limbs_[i] != 0;
    } else if (at < left_off) {
      rest = rest || (limbs_[i] & ((std::uint32_t{1} << (left_off - at)) - 1)) != 0;
      high |= limbs_[i] >> (left_off - at);
    } else {
      high |= std::uint64_t{limbs_[i]} << (at - left_off);
    }
  }
  const double magnitude = std::ldexp(static_cast<double>(high | static_cast<std::uint64_t>(rest)),
                                      static_cast<int>(std::min<std::size_t>(left_off, 100'000)));
  return minus_ ? -magnitude : magnitude;
}

std::string WholeNumber::text(int base) const {
  if (limbs_.empty()) return "0";
  std::string out;
  // Several digits at a time: the largest power of the base that fits into a limb.
  std::uint32_t power = 1;
  int digits = 0;
  while (std::uint64_t{power} * static_cast<unsigned>(base) <= UINT32_MAX) {
    power *= static_cast<std::uint32_t>(base);
    ++digits;
  }
  WholeNumber rest = *this;
  while (!rest.limbs_.empty()) {
    std::uint32_t some = rest.divide_by(power);
    for (int i = 0; i < digits && (some != 0 || !rest.limbs_.empty()); ++i) {
      out += "0123456789abcdefghijklmnopqrstuvwxyz"[some % static_cast<unsigned>(base)];
      some /= static_cast<std::uint32_t>(base);
    }
  }
  if (minus_) out += '-';
  std::reverse(out.begin(), out.end());
  return out;
}

WholeNumber WholeNumber::operator-() const {
  return {!minus_, limbs_};
}

int WholeNumber::compare(const Limbs& a, const Limbs& b) {
  if (a.size() != b.size()) return a.size() < b.size() ? -1 : 1;
  for (std::size_t i = a.size(); i-- > 0;) {
    if (a[i] != b[i]) return a[i] < b[i] ? -1 : 1;
  }
  return 0;
}

int WholeNumber::compare(const WholeNumber& a, const WholeNumber& b) {
  if (a.minus_ != b.minus_) return a.minus_ ? -1 : 1;
  return a.minus_ ? compare(b.limbs_, a.limbs_) : compare(a.limbs_, b.limbs_);
}

WholeNumber::Limbs WholeNumber::sum(const Limbs& a, const Limbs& b) {
  Limbs out;
  std::uint64_t carry = 0;
  for (std::size_t i = 0; i < std::max(a.size(), b.size()) || carry != 0; ++i) {
    carry += std::uint64_t{i < a.size() ? a[i] : 0} + (i < b.size() ? b[i] : 0);
    out.push_back(static_cast<std::uint32_t>(carry));
    carry >>= 32;
  }
  return out;
}

WholeNumber::Limbs WholeNumber::difference(const Limbs& a, const Limbs& b) {
  Limbs out;
  std::int64_t borrow = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    borrow += std::int64_t{a[i]} - (i < b.size() ? b[i] : 0);
    out.push_back(static_cast<std::uint32_t>(borrow));
    borrow >>= 32;
  }
  return out;
}

WholeNumber operator+(const WholeNumber& a, const WholeNumber& b) {
  if (a.minus_ == b.minus_) return {a.minus_, WholeNumber::sum(a.limbs_, b.limbs_)};
  const bool first = WholeNumber::compare(a.limbs_, b.limbs_) >= 0;
  const WholeNumber &large = first ? a : b, &little = first ? b : a;
  return {large.minus_, WholeNumber::difference(large.limbs_, little.limbs_)};
}

WholeNumber operator*(const WholeNumber& a, const WholeNumber& b) {
  WholeNumber::Limbs out(a.limbs_.size() + b.limbs_.size());
  for (std::size_t i = 0; i < a.limbs_.size(); ++i) {
    std::uint64_t carry = 0;
    for (std::size_t j = 0; j < b.limbs_.size(); ++j) {
      carry += std::uint64_t{a.limbs_[i]} * b.limbs_[j] + out[i + j];
      out[i + j] = static_cast<std::uint32_t>(carry);
      carry >>= 32;
    }
    out[i + b.limbs_.size()] = static_cast<std::uint32_t>(carry);
  }
  return {a.minus_ != b.minus_, std::move(out)};
}

// Bit by bit: numbers are short here, and divisions rare.
std::pair<WholeNumber, WholeNumber> WholeNumber::divide(const WholeNumber& a, const WholeNumber& b) {
  Limbs quotient(a.limbs_.size());
  WholeNumber rest;
  const WholeNumber divisor(false, b.limbs_);
  for (std::size_t bit = a.bits(); bit-- > 0;) {
    rest.multiply_add(2, a.limbs_[bit / 32] >> (bit % 32) & 1);
    if (compare(rest.limbs_, divisor.limbs_) < 0) continue;
    rest = rest - divisor;
    quotient[bit / 32] |= std::uint32_t{1} << (bit % 32);
  }
  WholeNumber whole(a.minus_ != b.minus_, std::move(quotient));
  rest = WholeNumber(a.minus_, std::move(rest.limbs_));
  if (!rest.zero() && rest.minus_ != b.minus_) {
    whole = whole - WholeNumber(std::int64_t{1});
    rest = rest + b;
  }
  return {std::move(whole), std::move(rest)};
}

double WholeNumber::quotient(const WholeNumber& a, const WholeNumber& b) {
  // More bits than a double has, and one that represents the rest.
  constexpr std::size_t kEnough = 66;
  const std::size_t shift = kEnough + b.bits() > a.bits() ? kEnough + b.bits() - a.bits() : 0;
  WholeNumber dividend(false, a.limbs_);
  for (std::size_t left = shift; left > 0; left -= std::min<std::size_t>(left, 31))
    dividend.multiply_add(std::uint32_t{1} << std::min<std::size_t>(left, 31), 0);
  auto [whole, rest] = divide(dividend, {false, b.limbs_});
  whole.multiply_add(2, rest.zero() ? 0 : 1);
  const double magnitude = std::ldexp(whole.real(), -static_cast<int>(shift) - 1);
  return a.minus_ != b.minus_ ? -magnitude : magnitude;
}

void WholeNumber::multiply_add(std::uint32_t factor, std::uint32_t summand) {
  std::uint64_t carry = summand;
  for (std::uint32_t& limb : limbs_) {
    carry += std::uint64_t{limb} * factor;
    limb = static_cast<std::uint32_t>(carry);
    carry >>= 32;
  }
  if (carry != 0) limbs_.push_back(static_cast<std::uint32_t>(carry));
}

std::uint32_t WholeNumber::divide_by(std::uint32_t divisor) {
  std::uint64_t rest = 0;
  for (std::size_t i = limbs_.size(); i-- > 0;) {
    rest = rest << 32 | limbs_[i];
    limbs_[i] = static_cast<std::uint32_t>(rest / divisor);
    rest %= divisor;
  }
  while (!limbs_.empty() && limbs_.back() == 0) limbs_.pop_back();
  return static_cast<std::uint32_t>(rest);
}

}  // namespace doppel
