#pragma once
// A robot of the corpus (tests/broken_robots), written as a package into a folder of its own.

#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>

#include "doppel/validation/checks/subject.h"
#include "doppel/validation/checks/suite.h"

namespace doppel {

inline const std::filesystem::path& broken_robots_corpus() {
  static const std::filesystem::path folder = DOPPEL_SOURCE_DIR "/tests/broken_robots";
  return folder;
}

// The files are removed with it.
class BrokenRobotFiles {
 public:
  explicit BrokenRobotFiles(const std::string& name) : name_(name) {
    std::string pattern = (std::filesystem::temp_directory_path() / "doppel-broken.XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
    const std::string make = (broken_robots_corpus() / "make").string() + " " + folder_.string() + " " + name;
    if (std::system(make.c_str()) != 0) throw std::runtime_error("there is no broken robot " + name);
  }
  ~BrokenRobotFiles() { std::filesystem::remove_all(folder_); }
  BrokenRobotFiles(const BrokenRobotFiles&) = delete;
  BrokenRobotFiles& operator=(const BrokenRobotFiles&) = delete;

  [[nodiscard]] Subject subject(bool enforce_limits = true) const {
    Scenario scenario;
    scenario.robots = {{.target = (folder_ / name_).string()}};
    scenario.enforce_limits = enforce_limits;
    return read_subject(scenario, {});
  }
  [[nodiscard]] Suite suite() const { return load_suite(folder_ / name_ / "validation" / "suite.yaml"); }

 private:
  std::string name_;
  std::filesystem::path folder_;
};

}  // namespace doppel
