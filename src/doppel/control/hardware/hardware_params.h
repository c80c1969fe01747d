#pragma once
// Reads the <param>s of a hardware component or of one of its joints and collects all of their errors.

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/export.h"

namespace doppel {

struct PlacedParam {
  std::string name, value;
  SourceLocation where;
};

class DOPPEL_API HardwareParams {
 public:
  // `what` names their owner: "hardware 'arm'". Every name that is not among `known` is an error, with the
  // nearest one. Of two params with one name the first one counts.
  HardwareParams(std::string what, std::vector<PlacedParam> params, std::vector<std::string> names,
                 Diagnostics& errors);

  [[nodiscard]] bool has(std::string_view name) const { return find(name) != nullptr; }
  // A value with an error is `otherwise`.
  [[nodiscard]] double number(const std::string& name, double otherwise, double least, double most);
  [[nodiscard]] int whole(const std::string& name, int otherwise, int least, int most);
  [[nodiscard]] bool flag(const std::string& name, bool otherwise);
  // The index of the text among `options`.
  [[nodiscard]] std::size_t choice(const std::string& name, const std::vector<std::string>& options,
                                   std::size_t otherwise);
  [[nodiscard]] std::string text(const std::string& name, const std::string& otherwise = "") const;
  [[nodiscard]] SourceLocation where(const std::string& name) const;
  void report_problem(const std::string& name, const std::string& why);

 private:
  [[nodiscard]] const PlacedParam* find(std::string_view name) const;

  std::string what_;
  std::vector<PlacedParam> params_;
  Diagnostics& errors_;
};

// The params of a description, at one place.
DOPPEL_API std::vector<PlacedParam> placed_params(
    const std::vector<std::pair<std::string, std::string>>& params, const SourceLocation& where);

}  // namespace doppel
