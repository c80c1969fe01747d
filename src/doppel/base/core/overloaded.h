#pragma once
// A visitor of a std::variant made of one lambda for each alternative: std::visit(Overloaded{...}, value).

namespace doppel {

template <class... Cases>
struct Overloaded : Cases... {
  using Cases::operator()...;
};
template <class... Cases>
Overloaded(Cases...) -> Overloaded<Cases...>;  // for clang 14, which does not deduce aggregates (P1816)

}  // namespace doppel
