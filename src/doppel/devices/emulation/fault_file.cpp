#include "doppel/devices/emulation/fault_file.h"

#include <fmt/format.h>

#include <cmath>

#include "doppel/base/math/quantity.h"
#include "doppel/base/yaml/yaml_fields.h"

namespace doppel {
namespace {

const YamlRules kRules{"faults.syntax", "faults.unreadable", "faults.too_large", "faults.invalid",
                       "faults.unknown_key"};

constexpr double kMaxId = 253;        // of the frames of both buses
constexpr double kMaxAmount = 1'000;  // degrees Celsius

class FaultReader : YamlFields {
 public:
  explicit FaultReader(Time start) : YamlFields(kRules), start_(start) {}

  std::vector<EmulatedFault> read(const std::filesystem::path& file) {
    const PlacedYaml root = load_yaml(file, kRules, "file of faults");
    std::vector<EmulatedFault> out;
    if (fields(root, "a file of faults", {"faults"})) {
      const PlacedYaml& list = root["faults"];
      if (list && !list.is_list()) error(list, "faults must be a list");
      for (const PlacedYaml& item : list.items) {
        if (auto fault = read_one(item)) out.push_back(*fault);
      }
    }
    errors().throw_if_errors();
    return out;
  }

 private:
  std::optional<EmulatedFault> read_one(const PlacedYaml& item) {
    if (!fields(item, "a fault", {"fault", "servo", "begin", "end", "share", "amount"})) return {};
    if (!item["fault"]) {
      error(item, "a fault needs the key fault", "write for instance {fault: unplug, begin: 2 s, end: 3 s}");
      return {};
    }
    EmulatedFault out;
    const std::vector<std::string> kinds = fault_kinds();
    const std::size_t kind = choice(item["fault"], "fault", kinds);
    out.kind = *fault_kind(kinds[kind]);
    if (item["servo"]) out.servo = static_cast<int>(ranged(item["servo"], "servo", 0, kMaxId));
    out.begin = start_ + seconds(item["begin"], "begin");
    if (item["end"]) {
      out.end = start_ + seconds(item["end"], "end");
      if (out.end <= out.begin) error(item["end"], "a fault must end after it begins");
    }
    if (item["share"]) out.share = quantity(item["share"], "share", QuantityKind::share);
    if (out.share < 0 || out.share > 1) error(item["share"], "share must be from 0 to 1");
    if (item["amount"]) out.amount = amount(item["amount"], out.kind);
    return out;
  }

  double amount(const PlacedYaml& value, FaultKind kind) {
    if (kind == FaultKind::slip) return quantity(value, "amount", QuantityKind::angle);
    if (kind == FaultKind::late) return to_seconds(seconds(value, "amount"));
    return ranged(value, "amount", -kMaxAmount, kMaxAmount);
  }

  double ranged(const PlacedYaml& value, const std::string& what, double low, double high) {
    const double out = number(value, what);
    if (out >= low && out <= high) return out;
    error(value, fmt::format("{} must be from {:g} to {:g}", what, low, high));
    return low;
  }

  Duration seconds(const PlacedYaml& value, const std::string& what) {
    constexpr double kMaxSeconds = 1e6;
    if (!value) return {};
    const double out = quantity(value, what, QuantityKind::time);
    if (out < 0 || out > kMaxSeconds) {
      error(value, fmt::format("{} must be from 0 to {:g} s", what, kMaxSeconds));
      return {};
    }
    return from_seconds(out);
  }

  double quantity(const PlacedYaml& value, const std::string& what, QuantityKind kind) {
    const std::optional<double> out = parse_quantity(text(value, what), kind);
    if (!out) error(value, fmt::format("{} must be a number, for instance {}", what, example_of(kind)));
    return out.value_or(0);
  }

  const Time start_;
};

}  // namespace

std::vector<EmulatedFault> read_fault_file(const std::filesystem::path& file, Time start) {
  return FaultReader(start).read(file);
}

std::optional<std::vector<EmulatedFault>> FaultFile::read_if_changed(Time now) {
  const FileVersion version = FileVersion::of(file_);
  // An editor replaces a file: it is not there for a moment.
  if (read_ && (version == FileVersion{} || version == *read_)) return {};
  read_ = version;
  return read_fault_file(file_, now);
}

std::optional<std::vector<EmulatedFault>> read_again(FaultFile& file, Time now, const Log& log,
                                                     const std::string& origin) {
  try {
    auto out = file.read_if_changed(now);
    if (out) log.note(origin, fmt::format("{} faults from now on", out->size()));
    return out;
  } catch (const InputError& problem) {
    for (const Diagnostic& one : problem.diagnostics()) log.warning(origin, one.str());
    return {};
  }
}

}  // namespace doppel
