#pragma once
// Whole numbers of any size, for Python's ints beyond 64 bits. Source: Knuth, The Art of Computer
// Programming, volume 2, 4.3.1 (the classical algorithms); here by limbs of 32 bits.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace doppel {

class WholeNumber {
 public:
  static constexpr std::size_t kMaxBits = 4096;  // limit for the values of expressions

  WholeNumber() = default;
  explicit WholeNumber(std::int64_t value);
  // Truncated; precondition: finite.
  explicit WholeNumber(double value);
  // Only digits of that base (2 to 36); null: other characters, or none.
  static std::optional<WholeNumber> parse(std::string_view digits, int base);

  [[nodiscard]] bool negative() const { return minus_; }
  [[nodiscard]] bool zero() const { return limbs_.empty(); }
  [[nodiscard]] std::size_t bits() const;  // of the magnitude
  [[nodiscard]] std::optional<std::int64_t> small() const;
  [[nodiscard]] double real() const;                    // infinite where it exceeds every double
  [[nodiscard]] std::string text(int base = 10) const;  // small letters; "-" in front

  WholeNumber operator-() const;
  friend WholeNumber operator+(const WholeNumber& a, const WholeNumber& b);
  friend WholeNumber operator-(const WholeNumber& a, const WholeNumber& b) { return a + -b; }
  friend WholeNumber operator*(const WholeNumber& a, const WholeNumber& b);
  // Quotient towards minus infinity and a remainder with the divisor's sign, as Python's divmod; b is not 0.
  static std::pair<WholeNumber, WholeNumber> divide(const WholeNumber& a, const WholeNumber& b);
  // a / b, correctly rounded; b is not 0.
  static double quotient(const WholeNumber& a, const WholeNumber& b);
  // -1, 0, 1.
  static int compare(const WholeNumber& a, const WholeNumber& b);

 private:
  using Limbs = std::vector<std::uint32_t>;  // the least first, none of them a leading zero
  WholeNumber(bool minus, Limbs limbs);
  static int compare(const Limbs& a, const Limbs& b);
  static Limbs sum(const Limbs& a, const Limbs& b);
  static Limbs difference(const Limbs& a, const Limbs& b);  // a >= b
  void multiply_add(std::uint32_t factor, std::uint32_t summand);
  std::uint32_t divide_by(std::uint32_t divisor);  // the remainder

  bool minus_ = false;
  Limbs limbs_;
};

}  // namespace doppel
