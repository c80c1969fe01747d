// Fuzz target: the journal of a stranger's recording. The lines of the first part are the kind, source,
// target and type of an input, the rest is its CDR. Nothing is written beside the files of the run.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <sstream>

#include "doppel/base/core/fuzz/input_file.h"
#include "doppel/lab/resimulation/resimulation.h"

namespace {

namespace fs = std::filesystem;

constexpr const char* kArm = R"(<robot name="arm"><link name="world"/><link name="base"/>
<joint name="j1" type="revolute"><parent link="world"/><child link="base"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" effort="1" velocity="4"/></joint>
<ros2_control name="Arm" type="system"><hardware><plugin>mujoco_ros2_control/MujocoSystem</plugin></hardware>
<joint name="j1"><command_interface name="position"/><state_interface name="position"/></joint>
</ros2_control></robot>)";

// The folder of a run is in one that has nothing else.
doppel::RecordedRun recorded_run() {
  doppel::RecordedRun out;
  out.folder = doppel::fuzz_folder() / "run";
  out.root = "/home/somebody/arm";
  fs::remove_all(out.folder);
  fs::create_directories(out.folder);
  std::ofstream(out.folder / "arm.urdf") << kArm;
  out.scenario.robots = {{.target = (out.folder / "arm.urdf").string()}};
  for (const std::uint64_t step : {1, 3}) out.hashes.push_back({.step = step});
  return out;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static doppel::RecordedRun run = recorded_run();
  const std::string text(reinterpret_cast<const char*>(data), size);
  const std::size_t end = std::min(text.find('\0'), size);
  std::istringstream lines(text.substr(0, end));
  doppel::doppel_msgs::msg::Input input;
  std::string kind;
  std::getline(lines, kind);
  input.kind = kind.empty() ? 0 : static_cast<std::uint8_t>(kind.front() - '0');
  std::getline(lines, input.source);
  std::getline(lines, input.target);
  std::getline(lines, input.type);
  input.data.assign(data + std::min(end + 1, size), data + size);
  if (input.kind == doppel::doppel_msgs::msg::Input::OUTCOME) return 0;  // waits for work that is not there
  input.step = 1;
  run.inputs = {input};
  static_cast<void>(doppel::resimulate(run, {}));
  const bool escaped = std::ranges::any_of(fs::directory_iterator(run.folder.parent_path()),
                                           [](const auto& one) { return one.path().filename() != "run"; });
  if (escaped) std::abort();
  // The next input begins with the files of the run.
  if (input.kind == doppel::doppel_msgs::msg::Input::EDIT) run = recorded_run();
  return 0;
}
