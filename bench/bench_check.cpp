// The time of doppel check as a whole process, with meshes cached and without, compared with a process that
// does nothing:  build/bin/bench_check [runs] [target ...]
#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

extern char** environ;

namespace {

namespace fs = std::filesystem;

struct Times {
  std::vector<double> wall, cpu;  // ms
};

double cpu_of_children() {
  rusage usage{};
  getrusage(RUSAGE_CHILDREN, &usage);
  const auto ms = [](const timeval& t) {
    return 1e3 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_usec);
  };
  return ms(usage.ru_utime) + ms(usage.ru_stime);
}

void run(const std::vector<std::string>& words, Times& times) {
  std::vector<char*> argv;
  for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  const double cpu = cpu_of_children();
  const auto begin = std::chrono::steady_clock::now();
  pid_t child = 0;
  int status = 0;
  if (posix_spawn(&child, argv[0], &files, nullptr, argv.data(), environ) != 0 ||
      waitpid(child, &status, 0) != child || !WIFEXITED(status) || WEXITSTATUS(status) > 1) {
    fmt::print(stderr, "failed: {}\n", fmt::join(words, " "));
    std::exit(1);
  }
  times.wall.push_back(
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());
  times.cpu.push_back(cpu_of_children() - cpu);
  posix_spawn_file_actions_destroy(&files);
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

void print(const std::string& what, const Times& times) {
  fmt::print("  {:40} {:7.1f} {:7.1f} {:7.1f}\n", what, median(times.wall),
             *std::min_element(times.wall.begin(), times.wall.end()), median(times.cpu));
}

}  // namespace

int main(int argc, char** argv) {
  const int runs = argc > 1 ? std::max(1, std::atoi(argv[1])) : 30;
  std::vector<std::string> targets(argv + std::min(argc, 2), argv + argc);
  if (targets.empty()) targets = {"omarm_one", "omarm_zero", "lab_arm"};
  const fs::path doppel = fs::canonical("/proc/self/exe").parent_path() / "doppel";
  const fs::path cache = fs::temp_directory_path() / fmt::format("doppel_bench_{}", getpid());
  setenv("XDG_CACHE_HOME", cache.c_str(), 1);
  fmt::print("doppel check, {} runs, milliseconds           median   least     cpu\n", runs);
  Times nothing;
  for (int i = 0; i < runs; ++i) run({doppel, "--version"}, nothing);
  print("--version", nothing);
  for (const std::string& target : targets) {
    Times cold, warm;
    for (int i = 0; i < std::min(runs, 5); ++i) {
      fs::remove_all(cache);
      run({doppel, "check", target}, cold);
    }
    for (int i = 0; i < runs; ++i) run({doppel, "check", target}, warm);
    print(target + ", every mesh looked at", cold);
    print(target + ", meshes cached", warm);
  }
  fs::remove_all(cache);
}
