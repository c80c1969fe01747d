// The speed of xacro. Every case of the corpus is expanded in this process (only the expansion of a document
// that was read, with everything it includes and loads; and with reading and writing; both in CPU time) and
// as users type it, `./doppel xacro FILE` (wall-clock and CPU time). The results are compared with the
// reference's times in the corpus's manifest; with --reference FOLDER (a checkout of ros/xacro) the reference
// is measured in the same run, as a process like its command `xacro`.
//
//   bench_xacro [--corpus FOLDER] [--program doppel] [--reference FOLDER] [--python PYTHON] [--runs N]
//               [--case PART_OF_ITS_NAME]
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
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "doppel/description/xacro/xacro.h"

extern char** environ;

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using Clock = std::chrono::steady_clock;

struct Options {
  fs::path corpus = fs::path(DOPPEL_SOURCE_DIR) / ".." / "shared" / "corpus";
  fs::path program = fs::path(DOPPEL_SOURCE_DIR) / "doppel", reference;
  std::string python =
      "python3";            // as the user has it; may be a script that selects the interpreter, like pyenv's
  std::string interpreter;  // the interpreter that it starts
  int runs = 5;
  std::string part;  // of the names of the cases to measure
};

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

// CPU time of this thread, ms: other programs on the machine do not count.
double computed() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

template <class Work>
double computed_milliseconds(int runs, const Work& work) {
  std::vector<double> took;
  for (int i = 0; i < runs; ++i) {
    const double begin = computed();
    work();
    took.push_back(computed() - begin);
  }
  return median(took);
}

// The times of a process, ms.
struct Process {
  double wall = 0, computed = 0;
};

// Runs `words`; the output is discarded, or written to `answer`.
Process run(const std::vector<std::string>& words, const fs::path& answer = "/dev/null") {
  std::vector<char*> argv;
  for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 1, answer.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_addopen(&actions, 2, "/dev/null", O_WRONLY, 0);
  pid_t child = 0;
  rusage used{};
  const auto begin = Clock::now();
  if (posix_spawnp(&child, argv[0], &actions, nullptr, argv.data(), environ) == 0)
    wait4(child, nullptr, 0, &used);
  const double wall = std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
  posix_spawn_file_actions_destroy(&actions);
  const auto milliseconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_usec) * 1e-3;
  };
  return {wall, milliseconds(used.ru_utime) + milliseconds(used.ru_stime)};
}

// The medians of several runs.
Process measured(int runs, const std::vector<std::string>& words) {
  std::vector<double> wall, computed;
  for (int i = 0; i < runs; ++i) {
    const Process one = run(words);
    wall.push_back(one.wall);
    computed.push_back(one.computed);
  }
  return {median(wall), median(computed)};
}

// Folders that contain each package of a case under its name, like an installation.
fs::path installed(const Options& options, const Json& packages, const fs::path& place) {
  fs::remove_all(place);
  fs::create_directories(place / "share");
  for (const auto& [name, folder] : packages.items())
    fs::create_directory_symlink(options.corpus / folder.get<std::string>(), place / "share" / name);
  return place;
}

// The parts of ROS that ros/xacro needs: the locations of packages, from AMENT_PREFIX_PATH as in
// ament_index_python; and for the ROS 1 branch, $(...) as in roslaunch.
void write_index(const fs::path& folder) {
  for (const char* package : {"ament_index_python", "roslaunch", "rospkg"}) {
    fs::create_directories(folder / package);
    std::ofstream(folder / package / "__init__.py") << "";
  }
  std::ofstream(folder / "ament_index_python" / "packages.py") << R"py(
import os
def get_package_share_directory(name):
    for prefix in os.environ['AMENT_PREFIX_PATH'].split(':'):
        folder = os.path.join(prefix, 'share', name)
        if os.path.isdir(folder):
            return folder
    raise LookupError(name)
)py";
  std::ofstream(folder / "rospkg" / "common.py") << "class ResourceNotFound(Exception): pass\n";
  std::ofstream(folder / "roslaunch" / "substitution_args.py") << R"py(
import os, re
from ament_index_python.packages import get_package_share_directory
class ArgException(Exception): pass
def resolve_args(text, context, resolve_anon=False):
    def value(match):
        command, *names = match.group(1).split()
        if command == 'arg' and names[0] not in context['arg']:
            raise ArgException(names[0])
        if command == 'arg':
            return context['arg'][names[0]]
        if command == 'find':
            return get_package_share_directory(names[0])
        return os.environ.get(names[0], ' '.join(names[1:]))
    return re.sub(r'[$][(]([^)]*)[)]', value, text)
)py";
}

// Python's time for its expansion alone, in milliseconds.
constexpr const char* kTimed = R"py(
import io, json, os, sys, time, types, contextlib
folder, packages, runs, file = sys.argv[1], json.loads(sys.argv[2]), int(sys.argv[3]), sys.argv[4]
sys.path[:0] = [folder, folder + '/src']
ament = types.ModuleType('ament_index_python'); inner = types.ModuleType('ament_index_python.packages')
inner.get_package_share_directory = lambda name: packages[name]
sys.modules['ament_index_python'] = ament; sys.modules['ament_index_python.packages'] = inner
import xacro
mappings = dict(a.split(':=') for a in sys.argv[5:])
whole, proper = [], []
for _ in range(runs):
    with contextlib.redirect_stderr(io.StringIO()):
        begin = time.thread_time()
        xacro.init_stacks(file)
        document = xacro.parse(None, file)
        read = time.thread_time()
        xacro.process_doc(document, mappings=dict(mappings))
        done = time.thread_time()
        document.toprettyxml(indent='  ')
        whole.append((time.thread_time() - begin) * 1e3)
        proper.append((done - read) * 1e3)
print(sorted(proper)[len(proper) // 2], sorted(whole)[len(whole) // 2])
)py";

struct Row {
  std::string id;
  double proper = 0, expansion = 0, reference_proper = 0, reference_expansion = 0;
  Process process, reference_process,
      interpreter_process;  // the last one: without the overhead of python3's script
};

Row measure(const Options& options, const Json& record, const fs::path& scratch) {
  Row row;
  row.id = record["id"];
  const std::string file = (options.corpus / record["input"].get<std::string>()).string();
  for (const auto& [name, value] : record["env"].items())
    setenv(name.c_str(), value.get<std::string>().c_str(), 1);
  doppel::PackageResolver resolver;
  Json folders;
  for (const auto& [name, folder] : record["packages"].items()) {
    resolver.add_package(name, options.corpus / folder.get<std::string>());
    folders[name] = (options.corpus / folder.get<std::string>()).string();
  }
  std::vector<std::string> words{options.program.string(), "xacro", file};
  std::vector<std::pair<std::string, std::string>> arguments;
  for (const std::string word : record["args"]) {
    words.push_back(word);
    arguments.emplace_back(word.substr(0, word.find(":=")), word.substr(word.find(":=") + 2));
  }
  std::vector<double> took;
  for (int i = 0; i < options.runs; ++i) {
    doppel::Diagnostics diagnostics;
    doppel::XmlTree document = doppel::load_xml_tree(file);
    const double begin = computed();
    const auto result = doppel::expand_xacro(std::move(document), file, arguments, resolver, diagnostics);
    took.push_back(computed() - begin);
  }
  row.proper = median(took);
  row.expansion = computed_milliseconds(options.runs, [&] {
    doppel::Diagnostics diagnostics;
    const auto result =
        doppel::expand_xacro(doppel::load_xml_tree(file), file, arguments, resolver, diagnostics);
    doppel::xacro_text(result.tree, file);
  });
  setenv("AMENT_PREFIX_PATH", installed(options, record["packages"], scratch / "install").c_str(), 1);
  row.process = measured(options.runs, words);
  row.reference_process = {record["reference_ms"]["wall"], record["reference_ms"]["cpu"]};
  if (!options.reference.empty()) {
    const std::string folder = options.reference.string();
    setenv("PYTHONPATH", (folder + ":" + folder + "/src:" + (scratch / "index").string()).c_str(), 1);
    std::vector<std::string> whole{options.python, "-c", "import xacro; xacro.main()", file};
    whole.insert(whole.end(), words.begin() + 3, words.end());
    row.reference_process = row.interpreter_process = measured(options.runs, whole);
    if (options.interpreter != options.python) {
      whole[0] = options.interpreter;
      row.interpreter_process = measured(options.runs, whole);
    }
    std::vector<std::string> timed{options.python, "-c", kTimed, folder, folders.dump(), "3", file};
    timed.insert(timed.end(), words.begin() + 3, words.end());
    run(timed, scratch / "answer");
    std::ifstream(scratch / "answer") >> row.reference_proper >> row.reference_expansion;
  }
  return row;
}

void print(const std::vector<Row>& rows, const Options& options) {
  const bool measured = !options.reference.empty();
  fmt::print("{:<44} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>7} {:>7} {:>7} {:>7}\n",
             "case (ms; ./doppel: wall clock, CPU)", "proper", "expans.", "wall", "proc.", "ref.pr.",
             "ref.exp", "ref.wall", "ref.proc", "prop. x", "exp. x", "wall x", "proc. x");
  std::vector<double> proper, expansion, wall, computed, times, walls, computeds;
  for (const Row& r : rows) {
    wall.push_back(r.reference_process.wall / r.process.wall);
    computed.push_back(r.reference_process.computed / r.process.computed);
    fmt::print(
        "{:<44} {:>8.3f} {:>8.3f} {:>8.3f} {:>8.3f} {:>8.1f} {:>8.1f} {:>8.1f} {:>8.1f} {:>7.0f} {:>7.0f} "
        "{:>7.1f} {:>7.1f}\n",
        r.id, r.proper, r.expansion, r.process.wall, r.process.computed, r.reference_proper,
        r.reference_expansion, r.reference_process.wall, r.reference_process.computed,
        r.reference_proper / r.proper, r.reference_expansion / r.expansion, wall.back(), computed.back());
    proper.push_back(r.reference_proper / r.proper);
    expansion.push_back(r.reference_expansion / r.expansion);
    times.push_back(r.expansion);
    walls.push_back(r.process.wall);
    computeds.push_back(r.process.computed);
  }
  fmt::print(
      "\n{} cases; median expansion {:.3f} ms; ./doppel xacro as typed: median {:.3f} ms of wall-clock time, "
      "{:.3f} ms of CPU time\n",
      rows.size(), median(times), median(walls), median(computeds));
  fmt::print(
      "median ratio of the commands as typed: {:.1f} in wall-clock time, {:.1f} in CPU time "
      "(reference: {})\n",
      median(wall), median(computed), measured ? "measured in this run" : "from the manifest");
  if (!measured) return;
  std::vector<double> bare_wall, bare_computed;
  for (const Row& r : rows) {
    bare_wall.push_back(r.interpreter_process.wall / r.process.wall);
    bare_computed.push_back(r.interpreter_process.computed / r.process.computed);
  }
  fmt::print("with the interpreter {} instead of {}: {:.1f} in wall-clock time, {:.1f} in CPU time\n",
             options.interpreter, options.python, median(bare_wall), median(bare_computed));
  std::vector<Row> largest = rows;
  std::sort(largest.begin(), largest.end(),
            [](const Row& a, const Row& b) { return a.reference_expansion > b.reference_expansion; });
  largest.resize(std::min<std::size_t>(20, largest.size()));
  std::vector<double> proper_of_largest, of_largest;
  for (const Row& r : largest) {
    proper_of_largest.push_back(r.reference_proper / r.proper);
    of_largest.push_back(r.reference_expansion / r.expansion);
  }
  const auto print = [](const char* what, const std::vector<double>& all, const std::vector<double>& of_20) {
    fmt::print("median ratio of {} {:.0f}; of the 20 largest {:.0f} (least {:.0f})\n", what, median(all),
               median(of_20), *std::min_element(of_20.begin(), of_20.end()));
  };
  print("expansions proper", proper, proper_of_largest);
  print("expansions with reading and writing", expansion, of_largest);
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string name = argv[i], value = argv[i + 1];
    if (name == "--corpus") options.corpus = value;
    if (name == "--program") options.program = value;
    if (name == "--reference") options.reference = fs::absolute(value);
    if (name == "--python") options.python = value;
    if (name == "--case") options.part = value;
    if (name == "--runs") options.runs = std::max(1, std::atoi(value.c_str()));
  }
  std::error_code none;
  options.corpus = fs::weakly_canonical(options.corpus, none);
  options.program = fs::absolute(options.program);
  std::ifstream in(options.corpus / "manifest.json");
  if (!in) {
    fmt::print(stderr, "no corpus at {}; give --corpus FOLDER\n", options.corpus.string());
    return 2;
  }
  const fs::path scratch = fs::temp_directory_path() / fmt::format("bench_xacro.{}", getpid());
  fs::create_directories(scratch);
  write_index(scratch / "index");
  run({options.python, "-c", "import sys; print(sys.executable)"}, scratch / "interpreter");
  std::getline(std::ifstream(scratch / "interpreter") >> std::ws, options.interpreter);
  fs::current_path(options.corpus);
  std::vector<Row> rows;
  for (const Json& record : Json::parse(in)) {
    const bool wanted = record["id"].get<std::string>().find(options.part) != std::string::npos;
    if (wanted && record["kind"] != "urdf" && record["expect"] == "ok")
      rows.push_back(measure(options, record, scratch));
  }
  fs::remove_all(scratch);
  print(rows, options);
  return 0;
}
