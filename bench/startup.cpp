// Cold starts: the time from the start of the process to the first /joint_states and the peak memory, as
// reported by the program itself, and the time that the ./doppel script adds:  build/bin/bench_startup [runs]
// [robot]
#include <fmt/format.h>
#include <sys/wait.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

namespace {

std::string output_of(const std::string& command) {
  std::string out;
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return out;
  char buffer[4096];
  for (std::size_t got = 0; (got = fread(buffer, 1, sizeof buffer, pipe)) > 0;) out.append(buffer, got);
  if (pclose(pipe) != 0) {
    fmt::print(stderr, "failed: {}\n", command);
    std::exit(1);
  }
  return out;
}

double field(const std::string& json, const std::string& name) {
  const std::size_t at = json.find("\"" + name + "\":");
  return at == std::string::npos ? 0.0 : std::atof(json.c_str() + at + name.size() + 3);
}

double milliseconds(const std::string& command) {
  const auto begin = std::chrono::steady_clock::now();
  output_of(command);
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
}

void print(const char* what, std::vector<double> values, const char* unit) {
  std::sort(values.begin(), values.end());
  fmt::print("  {:34} median {:7.1f}  least {:7.1f}  most {:7.1f} {}\n", what, values[values.size() / 2],
             values.front(), values.back(), unit);
}

}  // namespace

int main(int argc, char** argv) {
  const int runs = argc > 1 ? std::max(1, std::atoi(argv[1])) : 20;
  const std::string robot = argc > 2 ? argv[2] : "omarm_one";
  const char* root = std::getenv("DOPPEL_ROOT");
  const std::string here = root != nullptr ? root : ".";
  std::vector<double> startup, memory, with_script, without_script;
  for (int i = 0; i < runs; ++i) {
    const std::string json =
        output_of(here + "/doppel up " + robot + " --headless --duration 0.05 --json 2>/dev/null");
    startup.push_back(field(json, "startup_ms"));
    memory.push_back(field(json, "peak_rss_mb"));
    with_script.push_back(milliseconds(here + "/doppel --version"));
    without_script.push_back(milliseconds(here + "/build/bin/doppel --version"));
  }
  std::vector<double> script;
  for (std::size_t i = 0; i < with_script.size(); ++i) script.push_back(with_script[i] - without_script[i]);
  fmt::print("up {} --headless, {} cold starts\n", robot, runs);
  print("process start to /joint_states", startup, "ms");
  print("peak memory", memory, "MB");
  print("what ./doppel adds before it runs", script, "ms");
}
