// The time from saving a file until the running arm continues with it: edits omarm_one's xacro under a real
// `doppel up` several times, and waits for the line that reports that the edit was applied:
//   build/bin/bench_reload [edits]
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

std::string text_of(const fs::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

class Twin {
 public:
  Twin(const fs::path& program, const fs::path& robot) {
    int ends[2];
    if (pipe(ends) != 0) std::abort();
    child_ = fork();
    if (child_ == 0) {
      dup2(ends[1], STDERR_FILENO);
      close(ends[0]);
      execl(program.c_str(), "doppel", "up", robot.c_str(), "--headless", "--no-ros", nullptr);
      _exit(127);
    }
    close(ends[1]);
    out_ = fdopen(ends[0], "r");
  }
  ~Twin() {
    kill(child_, SIGINT);
    waitpid(child_, nullptr, 0);
    std::fclose(out_);
  }
  // Reads lines until one contains `text`; false: the twin ended before.
  bool wait_for(const std::string& text) {
    char line[4096];
    while (std::fgets(line, sizeof line, out_) != nullptr) {
      if (std::string(line).find(text) != std::string::npos) return true;
    }
    return false;
  }

 private:
  pid_t child_ = 0;
  std::FILE* out_ = nullptr;
};

}  // namespace

int main(int argc, char** argv) {
  const int edits = argc > 1 ? std::atoi(argv[1]) : 20;
  const fs::path folder = fs::temp_directory_path() / fmt::format("doppel_bench_reload_{}", getpid());
  fs::create_directories(folder);
  fs::copy(fs::path(DOPPEL_ROBOTS) / "omarm_one", folder / "omarm_one", fs::copy_options::recursive);
  const fs::path xacro = folder / "omarm_one/urdf/omarm.xacro";
  const std::string before = text_of(xacro);
  std::string after = before;
  after.replace(after.find("velocity=\"5.2\""), 14, "velocity=\"5.1\"");
  std::vector<double> times;
  {
    Twin twin(fs::read_symlink("/proc/self/exe").parent_path() / "doppel", folder / "omarm_one");
    if (!twin.wait_for("ready")) return 1;
    for (int i = 0; i < edits; ++i) {
      usleep(200'000);
      const auto saved = Clock::now();
      std::ofstream(xacro) << (i % 2 == 0 ? after : before);
      if (!twin.wait_for("applied in")) return 1;
      times.push_back(std::chrono::duration<double, std::milli>(Clock::now() - saved).count());
    }
  }
  fs::remove_all(folder);
  std::sort(times.begin(), times.end());
  fmt::print(
      "omarm_one: {} edits, from saving to the applied edit: median {:.1f} ms ({:.1f} to {:.1f}; limit "
      "200)\n",
      edits, times[times.size() / 2], times.front(), times.back());
}
