#include "doppel/devices/drivers/check_record.h"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/fnv_hash.h"
#include "doppel/base/core/output_file.h"
#include "doppel/base/yaml/placed_yaml.h"
#include "doppel/base/yaml/yaml_text.h"
#include "doppel/devices/drivers/pose_record.h"
#include "doppel/devices/serial/serial_ports.h"

namespace doppel {
namespace {

const YamlRules kCheckRules{"hardware.check", "hardware.check", "hardware.check", "hardware.check",
                            "hardware.check"};

std::string short_hash(const std::string& text) {
  return fmt::format("{:016x}", fnv_hash(text));
}

}  // namespace

std::string fingerprint(const JointServo& servo) {
  return short_hash(fmt::format("{} {} {} {} {:.6g} {:.6g} {:.6g} {:.6g} {:.6g}", servo.joint, servo.id,
                                servo.model != nullptr ? servo.model->name : "hobby servo", servo.direction,
                                servo.scale, servo.offset, servo.lower, servo.upper, servo.velocity));
}

std::string fingerprint(const ServoSetup& setup) {
  std::string all = fmt::format("{} {}", setup.component, to_string(setup.protocol));
  for (const JointServo& one : setup.joints) all += fingerprint(one);
  return short_hash(all);
}

std::filesystem::path check_record_file(const std::string& component, const std::string& port) {
  std::string name = port;
  for (const PortInfo& one : serial_ports()) {
    if (one.path == port && !one.by_id.empty()) name = one.by_id;
  }
  const std::filesystem::path pose = pose_record_file(component, name);
  return pose.empty() ? pose : pose.parent_path().parent_path() / "checks" / pose.filename();
}

CheckRecord read_check_record(const std::filesystem::path& file) {
  std::error_code failed;
  CheckRecord out;
  if (file.empty() || !std::filesystem::is_regular_file(file, failed)) return out;
  try {
    const PlacedYaml root = load_yaml(file, kCheckRules, "record of checks");
    out.checked = root["checked"].text;
    const PlacedYaml& nudged = root["nudged"];
    for (std::size_t i = 0; i < nudged.keys.size(); ++i)
      out.nudged.emplace_back(nudged.keys[i].text, nudged.items[i].text);
  } catch (const InputError&) {
    return {};  // the arm is checked again
  }
  return out;
}

void write_check_record(const std::filesystem::path& file, const CheckRecord& record) {
  if (file.empty()) return;
  std::error_code ignored;
  std::filesystem::create_directories(file.parent_path(), ignored);
  std::string text =
      fmt::format("# What was checked of this arm; written by doppel.\nchecked: \"{}\"\nnudged:{}\n",
                  record.checked, record.nudged.empty() ? " {}" : "");
  for (const auto& [joint, print] : record.nudged)
    text += fmt::format("  {}: \"{}\"\n", yaml_text(joint), print);
  write_whole(file, text);
}

void add_nudged(CheckRecord& record, const JointServo& servo) {
  std::erase_if(record.nudged, [&](const auto& one) { return one.first == servo.joint; });
  record.nudged.emplace_back(servo.joint, fingerprint(servo));
}

bool is_checked(const CheckRecord& record, const ServoSetup& setup) {
  return record.checked == fingerprint(setup);
}

std::vector<std::string> unconfirmed_joints(const CheckRecord& record, const ServoSetup& setup) {
  std::vector<std::string> out;
  for (const JointServo& one : setup.joints) {
    const bool confirmed =
        std::ranges::find(record.nudged, std::pair(one.joint, fingerprint(one))) != record.nudged.end();
    if (one.enabled && !confirmed) out.push_back(one.joint);
  }
  return out;
}

}  // namespace doppel
