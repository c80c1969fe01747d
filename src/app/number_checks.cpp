#include "app/number_checks.h"

#include <cmath>

namespace doppel::app {
namespace {

template <class Accept>
CLI::Validator number_check(const char* name, const char* demand, Accept accept) {
  return {[demand, accept](const std::string& text) -> std::string {
            double value = 0;
            if (!CLI::detail::lexical_cast(text, value) || !std::isfinite(value))
              return "'" + text + "' is not a finite number";
            return accept(value) ? "" : text + " is not " + demand;
          },
          name};
}

}  // namespace

CLI::Validator positive_number() {
  return number_check("POSITIVE", "greater than 0", [](double value) { return value > 0; });
}

CLI::Validator non_negative_number() {
  return number_check("NONNEGATIVE", "at least 0", [](double value) { return value >= 0; });
}

}  // namespace doppel::app
