#include "doppel/scenario/launch/launch_survey.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <random>
#include <span>
#include <string_view>
#include <system_error>

#include "doppel/base/core/shown_path.h"
#include "doppel/scenario/launch/detail/launch_json.h"
#include "doppel/scenario/launch/detail/launch_reader.h"
#include "doppel/scenario/launch/detail/launch_roles.h"
#include "doppel/scenario/launch/detail/spawn_arguments.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr std::chrono::seconds kMaxSurveyTime{10};
constexpr int kMaxReaders = 4;  // a launch file may end the one that reads it

// A folder for files that launch files make and for views of installed packages; made when one is needed.
class SurveyFolder {
 public:
  SurveyFolder() {
    std::random_device random;
    const auto number = (std::uint64_t{random()} << 32U) | random();
    path_ = fs::temp_directory_path() / fmt::format("doppel-survey-{:016x}", number);
  }
  ~SurveyFolder() {
    std::error_code none;
    fs::remove_all(path_, none);
  }
  SurveyFolder(const SurveyFolder&) = delete;
  SurveyFolder& operator=(const SurveyFolder&) = delete;
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

// A file of a view of a package is the package's.
fs::path real_file(const fs::path& file, const fs::path& folder) {
  std::error_code none;
  if (!file.string().starts_with(folder.string())) return file;
  const fs::path real = fs::weakly_canonical(file, none);
  return real.empty() ? file : real;
}
SourceLocation real_place(const SourceLocation& place, const fs::path& folder) {
  return place.known() ? make_location(real_file(*place.file, folder).string(), place.line, place.column)
                       : place;
}

// The launch file's own code names the file: one that does not exist could be any text. `package`:
// canonical, so that a file of a view of it is in it.
bool is_in_package(const SourceLocation& source, const fs::path& package) {
  if (!source.known() || fs::path(*source.file).lexically_normal() != *source.file) return false;
  std::error_code none;
  const fs::path file = fs::canonical(*source.file, none);
  const fs::path below = file.lexically_relative(package);
  return fs::is_regular_file(file, none) && !below.empty() && *below.begin() != "..";
}

// The code of a launch file can deliver any text, such as what it has read of other files. A report may be
// public, so it has only names that can be packages', and these texts.
bool is_package_name(std::string_view name) {
  constexpr std::size_t kMaxName = 64;
  constexpr std::string_view kCharacters = "abcdefghijklmnopqrstuvwxyz0123456789_-";
  return !name.empty() && name.size() <= kMaxName &&
         name.find_first_not_of(kCharacters) == std::string_view::npos;
}

struct ReportedText {
  std::string_view key, text;
};
constexpr std::array kEffects = std::to_array<ReportedText>({
    {"launch.confined.file", "a file was not written"},
    {"launch.confined.folder", "a folder was not made"},
    {"launch.confined.command", "a command was not run; its output is empty"},
});
// Python's classes of errors.
constexpr std::array kErrors = std::to_array<ReportedText>({
    {"LaunchError", "launch rejects this line"},
    {"SystemExit", "it ends its reader"},
    {"PermissionError", "it does what is not permitted while it is checked"},
    {"RecursionError", "its includes are in a circle, or nested too deeply"},
    {"FileNotFoundError", "a file does not exist"},
    {"OSError", "the operating system reports an error"},
    {"SyntaxError", "SyntaxError"},
    {"ImportError", "ImportError"},
    {"ModuleNotFoundError", "ModuleNotFoundError"},
    {"NameError", "NameError"},
    {"AttributeError", "AttributeError"},
    {"KeyError", "KeyError"},
    {"IndexError", "IndexError"},
    {"TypeError", "TypeError"},
    {"ValueError", "ValueError"},
    {"RuntimeError", "RuntimeError"},
});
constexpr const char* kOnPurpose =
    "nothing, if it is on purpose: while a package is checked its launch files may only read";

std::string_view reported_text(std::span<const ReportedText> texts, std::string_view key,
                               std::string_view otherwise) {
  const auto found = std::ranges::find(texts, key, &ReportedText::key);
  return found == texts.end() ? otherwise : found->text;
}

// The facts of one file's records.
class Facts {
 public:
  Facts(const fs::path& package, const fs::path& folder, SurveyedLaunch& out)
      : package_(package), folder_(folder), out_(out) {}

  void add(const LaunchDescription& description) {
    for (const NamedPackage& one : description.packages) add_package(one.name, one.source);
    for (LaunchExpansion one : description.expansions) {
      if (!is_in_package(one.source, package_)) continue;
      one.file = real_file(one.file, folder_);
      one.source = real_place(one.source, folder_);
      out_.expansions.push_back(std::move(one));
    }
    for (const LaunchRecord& record : description.records) visit(record);
  }

 private:
  void visit(const LaunchRecord& record) {
    switch (record.kind) {
      case LaunchKind::node:
        add_package(record.package, record.source);
        visit_program(record);
        break;
      case LaunchKind::process:
        if (!record.words.empty() &&
            is_simulator(launch_meaning("", fs::path(record.words[0]).filename().string())))
          out_.simulates = true;
        break;
      case LaunchKind::include:
        visit_include(record);
        break;
      case LaunchKind::gz_server:
        out_.simulates = true;
        break;
      case LaunchKind::gz_spawn_model:
        add_spawn(model_spawn(record.arguments), record.source);
        break;
      default:
        break;
    }
    for (const LaunchRecord& child : record.children) visit(child);
  }

  void visit_program(const LaunchRecord& record) {
    const LaunchMeaning meaning = launch_meaning(record.package, record.executable);
    out_.simulates = out_.simulates || is_simulator(meaning);
    if (meaning.role == LaunchRole::spawn) add_spawn(model_spawn(record.words), record.source);
  }

  void visit_include(const LaunchRecord& record) {
    const std::string file = fs::path(record.path).filename().string();
    const LaunchMeaning meaning = include_meaning(record.package, file);
    out_.simulates = out_.simulates || is_simulator(meaning);
    if (meaning.role == LaunchRole::spawn) add_spawn(model_spawn(record.arguments), record.source);
  }

  static bool is_simulator(const LaunchMeaning& meaning) { return meaning.role == LaunchRole::simulator; }

  // Models of files and of a database are other things than the robot.
  void add_spawn(const ModelSpawn& model, const SourceLocation& source) {
    out_.simulates = true;
    if ((model.topic.empty() && model.text.empty()) || !model.X_WR || !is_in_package(source, package_))
      return;
    out_.spawned.push_back({model.X_WR->translation().z(), real_place(source, folder_)});
  }

  void add_package(const std::string& name, const SourceLocation& source) {
    if (!is_package_name(name) || !is_in_package(source, package_)) return;
    out_.packages.push_back({name, real_place(source, folder_)});
  }

  const fs::path& package_;
  const fs::path& folder_;
  SurveyedLaunch& out_;
};

class Survey {
 public:
  Survey(const fs::path& package, const std::vector<fs::path>& files, PackageResolver resolver)
      : package_(fs::weakly_canonical(package)), files_(files), resolver_(std::move(resolver)) {
    for (const fs::path& file : files_) resolver_.add_context(file);
  }

  LaunchSurvey run() {
    try {
      for (int i = 0; i < kMaxReaders && next_ < files_.size() && !late_; ++i) read_rest();
    } catch (const InputError& error) {
      out_.unread = error.diagnostics().front();
      out_.unread->severity = Severity::note;
      return std::move(out_);
    } catch (const ConfinementError& error) {
      add_unread(
          fmt::format("launch files are not read: this kernel cannot confine their code ({})", error.what()),
          "check the package on a machine with Linux 3.17 or later");
      return std::move(out_);
    }
    if (next_ < files_.size()) {
      add_unread(fmt::format("{} of {} launch files are not read: {}", files_.size() - next_, files_.size(),
                             late_ ? "reading them takes too long" : "too many files end their reader"),
                 "");
    }
    return std::move(out_);
  }

 private:
  void add_unread(const std::string& text, const std::string& fix) {
    out_.unread =
        Diagnostic{Severity::note, "launch.unread", text, make_location(files_.at(next_).string()), fix};
  }

  // With one process.
  void read_rest() {
    std::vector<std::string> words = {"--survey"};
    for (std::size_t i = next_; i < files_.size(); ++i) words.push_back(fs::absolute(files_[i]).string());
    LaunchReader reader(std::move(words), resolver_, folder_.path(), &bounds_);
    for (; next_ < files_.size(); ++next_) {
      SurveyedLaunch& file = out_.files.emplace_back();
      file.file = files_[next_];
      const std::string problem = problem_of(reader, file);
      if (problem.empty()) continue;
      add_note(file, make_location(file.file.string()), problem,
               "a launch file describes, and does not wait, compute or call exit()");
      ++next_;
      return;
    }
  }

  // Why the reader cannot read further files; empty: it can.
  std::string problem_of(LaunchReader& reader, SurveyedLaunch& file) {
    try {
      const Json result = reader.next();
      late_ = reader.is_late();
      if (late_) return "the launch file takes too long to read";
      if (result.is_discarded()) return "the launch file ended its reader";
      add_result(result, file);
      return "";
    } catch (const InputError& error) {
      return error.diagnostics().front().message;
    } catch (const std::exception&) {
      return "the launch file wrote to its reader's pipe";
    }
  }

  void add_result(const Json& result, SurveyedLaunch& file) {
    const LaunchDescription description = launch_from_json(result);
    Facts(package_, folder_.path(), file).add(description);
    for (const Diagnostic& one : description.diagnostics.all()) {
      const std::string_view effect = reported_text(kEffects, one.rule, "");
      if (!effect.empty() && is_in_package(one.where, package_))
        add_note(file, one.where, std::string(effect), kOnPurpose);
    }
    if (const auto error = result.find("error"); error != result.end()) add_error(*error, file);
  }

  void add_error(const Json& error, SurveyedLaunch& file) {
    const std::string kind = error.value("kind", "");
    const SourceLocation where = launch_place(error);
    add_note(
        file, is_in_package(where, package_) ? where : make_location(file.file.string()),
        fmt::format("it is not read completely: {}", reported_text(kErrors, kind, "an error of its own")),
        kind == "PermissionError"
            ? kOnPurpose
            : fmt::format("'doppel launch {} --show' reports the reason; it runs the file's code",
                          shown_path(file.file)));
  }

  void add_note(SurveyedLaunch& file, const SourceLocation& where, const std::string& text,
                const std::string& fix) {
    file.notes.note("launch.unread", real_place(where, folder_.path()), text, fix);
  }

  fs::path package_;
  const std::vector<fs::path>& files_;
  SurveyFolder folder_;
  PackageResolver resolver_;
  ReaderBounds bounds_{std::chrono::steady_clock::now() + kMaxSurveyTime};
  LaunchSurvey out_;
  std::size_t next_ = 0;
  bool late_ = false;
};

}  // namespace

LaunchSurvey survey_launch_files(const fs::path& package, const std::vector<fs::path>& files,
                                 PackageResolver resolver) {
  if (files.empty()) return {};
  return Survey(package, files, std::move(resolver)).run();
}

}  // namespace doppel
