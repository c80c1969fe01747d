// doppel bag: recordings in MCAP files. info, check, recover; the others in bag_*.cpp.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <ctime>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/output.h"
#include "app/print_stderr.h"
#include "app/verbs/bag_verbs.h"
#include "app/verbs/interruptible_work.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/diagnostic.h"
#include "doppel/base/mcap/mcap_file_sink.h"
#include "doppel/base/mcap/mcap_reader.h"
#include "doppel/base/mcap/mcap_recovery.h"

namespace doppel::app {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr double kNanoseconds = 1e-9;
// Times before this are those of a simulation, from 0 on, not of a clock: 2001.
constexpr std::uint64_t kFirstClockTime = 1'000'000'000ULL * 1'000'000'000ULL;

// Runs `work` on an open file; what it throws names the file.
template <class Work>
auto on_file(const std::string& path, Work work) {
  try {
    return work(open_mcap_source(path));
  } catch (const InputError& problem) {
    std::vector<Diagnostic> named = problem.diagnostics();
    for (Diagnostic& one : named) {
      if (!one.where.known()) one.where = make_location(path);
    }
    throw InputError(std::move(named));
  }
}

}  // namespace

std::string size_text(std::uint64_t bytes) {
  const auto number = static_cast<double>(bytes);
  if (bytes < 1000) return fmt::format("{} B", bytes);
  if (bytes < 1'000'000) return fmt::format("{:.1f} kB", number / 1e3);
  return bytes < 1'000'000'000 ? fmt::format("{:.1f} MB", number / 1e6)
                               : fmt::format("{:.2f} GB", number / 1e9);
}

std::string bag_time_text(std::uint64_t time) {
  if (time < kFirstClockTime)
    return fmt::format("{:.3f} s of the simulation", static_cast<double>(time) * kNanoseconds);
  const auto seconds = static_cast<std::time_t>(time / 1'000'000'000);
  std::tm parts{};
  localtime_r(&seconds, &parts);
  char text[64];
  std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S", &parts);
  return fmt::format("{}.{:03}", text, time / 1'000'000 % 1000);
}

namespace {

std::string summary_text(const BagContents& bag) {
  const auto row = [](const char* name, const std::string& value) {
    return fmt::format("{:<13} {}\n", name, value);
  };
  std::string out;
  for (std::size_t i = 0; i < bag.files.size(); ++i)
    out += row(i == 0 ? "files" : "", fs::path(bag.files[i]).filename().string());
  out += row("size", size_text(bag.size));
  if (bag.messages > 0) {
    out += row("duration", fmt::format("{:.3f} s", static_cast<double>(bag.end - bag.start) * kNanoseconds));
    out += row("start", bag_time_text(bag.start));
    out += row("end", bag_time_text(bag.end));
  }
  out += row("messages", std::to_string(bag.messages));
  std::string compressions;
  for (const std::string& name : bag.compressions)
    compressions += fmt::format("{}{}", compressions.empty() ? "" : ", ", name.empty() ? "none" : name);
  if (!compressions.empty()) out += row("compression", compressions);
  if (!bag.attachments.empty()) out += row("attachments", std::to_string(bag.attachments.size()));
  if (!bag.library.empty()) out += row("written by", bag.library);
  std::size_t topic_width = 5, type_width = 4;
  for (const BagTopic& topic : bag.topics) {
    topic_width = std::max(topic_width, topic.name.size());
    type_width = std::max(type_width, topic.type.size());
  }
  if (!bag.topics.empty())
    out += fmt::format("\n{:<{}}  {:<{}}  messages\n", "topic", topic_width, "type", type_width);
  for (const BagTopic& topic : bag.topics) {
    out += fmt::format("{:<{}}  {:<{}}  {:>8}{}\n", topic.name, topic_width, topic.type, type_width,
                       topic.counted ? std::to_string(topic.messages) : "?",
                       topic.encoding == "cdr" ? "" : "  " + topic.encoding);
  }
  for (const std::string& note : bag.notes) out += "\nnote: " + note + "\n";
  return out;
}

std::string summary_json(const BagContents& bag) {
  Json out{{"version", 1}, {"files", bag.files}, {"size", bag.size}, {"messages", bag.messages}};
  if (bag.messages > 0) {
    out["start"] = bag.start;
    out["end"] = bag.end;
  }
  out["profile"] = bag.profile;
  out["library"] = bag.library;
  out["topics"] = Json::array();
  for (const BagTopic& topic : bag.topics) {
    Json one{{"name", topic.name}, {"type", topic.type}, {"encoding", topic.encoding}};
    one["messages"] = topic.counted ? Json(topic.messages) : Json();
    out["topics"].push_back(std::move(one));
  }
  out["notes"] = bag.notes;
  return out.dump(2) + "\n";
}

int run_info(const std::string& bag, bool json) {
  const BagReader reader(bag);
  deliver(json ? summary_json(reader.contents()) : summary_text(reader.contents()));
  return 0;
}

int run_check(const std::string& bag) {
  const std::vector<std::string> missing = BagReader(bag).contents().missing;
  bool is_right = missing.empty();
  std::string out;
  for (const std::string& file : missing)
    out += fmt::format("{}: metadata.yaml lists it, and it is not there\n", file);
  for (const std::string& file : files_of_bag(bag)) {
    bool cancelled = false;
    const McapCheck check = on_file(file, [&cancelled](const std::unique_ptr<McapSource>& source) {
      const InterruptibleWork work("of the bytes");
      return check_mcap(*source, [&](double done) { return !(cancelled = !work.progress(done)); });
    });
    if (cancelled) {
      print_stderr("\ninterrupted\n");
      return kInterrupted;
    }
    for (const std::string& problem : check.problems) out += fmt::format("{}: {}\n", file, problem);
    if (check.problems.empty()) out += fmt::format("{}: no damage, {} messages\n", file, check.messages);
    is_right = is_right && check.problems.empty();
  }
  if (!is_right) out += "doppel bag recover writes a copy of what is whole\n";
  deliver(out);
  return is_right ? 0 : 1;
}

// A folder with one file takes its place.
std::string single_file(const std::string& bag) {
  const std::vector<std::string> files = files_of_bag(bag);
  if (files.size() == 1) return files.front();
  throw InputError("cli.use", make_location(bag), fmt::format("the bag has {} files", files.size()),
                   fmt::format("recover them one by one: doppel bag recover {} -o COPY", files.front()));
}

int run_recover(const std::string& bag, const std::string& out, const McapWriterOptions& options) {
  const std::string file = single_file(bag);
  // The copy has its name once it is complete.
  const std::string partial = out + ".part";
  if (fs::exists(out)) {
    throw InputError("output.unwritable", {}, fmt::format("'{}' exists already", out),
                     "name another file, or remove this one");
  }
  McapRecovery about;
  try {
    McapFileSink sink(partial);
    about = on_file(file, [&](const std::unique_ptr<McapSource>& source) {
      const InterruptibleWork work("of the bytes");
      return recover_mcap(*source, sink, options, [&work](double done) { return work.progress(done); });
    });
    sink.sync();
  } catch (...) {
    std::error_code none;
    fs::remove(partial, none);
    throw;
  }
  if (about.cancelled) {
    fs::remove(partial);
    return interrupted_without_output();
  }
  fs::rename(partial, out);
  std::string text = fmt::format("{}: {} messages", out, about.messages);
  if (about.attachments > 0) text += fmt::format(", {} attachments", about.attachments);
  text += "\n";
  for (const std::string& loss : about.losses) text += "lost: " + loss + "\n";
  if (about.damaged_bytes > 0) text += fmt::format("{} in no whole record\n", size_text(about.damaged_bytes));
  deliver(text);
  return 0;
}

void add_info_verb(CLI::App& bag, int& exit_code) {
  CLI::App* verb = bag.add_subcommand("info", "Print files, duration, topics and counts of a recording");
  const auto path = std::make_shared<std::string>();
  const auto json = std::make_shared<bool>(false);
  verb->add_option("BAG", *path, "An .mcap file, or a folder of them")->required();
  verb->add_flag("--json", *json, "Print a JSON object to stdout; times in ns");
  verb->footer(
      "Examples:\n  doppel bag info run.mcap\n  doppel bag info rosbag2_2026_11_27/ --json | jq .topics");
  verb->callback([path, json, &exit_code] { exit_code = run_info(*path, *json); });
}

void add_check_verb(CLI::App& bag, int& exit_code) {
  CLI::App* verb = bag.add_subcommand("check", "Check every record, check sum and index of a recording");
  const auto path = std::make_shared<std::string>();
  verb->add_option("BAG", *path, "An .mcap file, or a folder of them")->required();
  verb->footer(
      "Exit code 1: something is damaged, or a file was not closed.\nExamples:\n  doppel bag check run.mcap");
  verb->callback([path, &exit_code] { exit_code = run_check(*path); });
}

void add_recover_verb(CLI::App& bag, int& exit_code) {
  CLI::App* verb =
      bag.add_subcommand("recover", "Write a copy of all that is whole in a damaged or unclosed recording");
  struct Recover {
    std::string file, out;
    McapWriterOptions writer;
  };
  const auto options = std::make_shared<Recover>();
  verb->add_option("FILE", options->file, "The damaged .mcap file, which is not changed")->required();
  verb->add_option("-o,--out", options->out, "The copy")->type_name("FILE")->required();
  verb->add_option("--compression", options->writer.compression, "Of the copy: zstd, lz4, or none")
      ->check(CLI::IsMember({"zstd", "lz4", "none"}))
      ->default_str("zstd");
  verb->footer("Examples:\n  doppel bag recover run.mcap -o whole.mcap");
  verb->callback([options, &exit_code] {
    if (options->writer.compression == "none") options->writer.compression.clear();
    exit_code = run_recover(options->file, options->out, options->writer);
  });
}

}  // namespace

void add_bag(CLI::App& app, const RosArguments& ros, int& exit_code) {
  CLI::App* verb = app.add_subcommand("bag", "Record runs (MCAP), look into them, play and run them again");
  verb->require_subcommand(1);
  verb->footer(
      "Examples:\n  doppel up omarm_one --record run      # from the first step on\n  doppel bag record -a "
      "-o "
      "later\n  doppel bag info run\n  doppel bag resimulate run\nSee doppel man bags.md");
  add_bag_record(*verb, exit_code);
  add_bag_snapshot(*verb, exit_code);
  add_bag_play(*verb, ros, exit_code);
  add_info_verb(*verb, exit_code);
  add_bag_convert(*verb, exit_code);
  add_bag_cut(*verb, exit_code);
  add_check_verb(*verb, exit_code);
  add_recover_verb(*verb, exit_code);
  add_bag_reindex(*verb, exit_code);
  add_bag_resimulate(*verb, exit_code);
}

}  // namespace doppel::app
