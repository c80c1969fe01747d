#include "doppel/lab/resimulation/resimulation.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <map>

#include "doppel/base/core/output_file.h"
#include "doppel/base/core/path_below.h"
#include "doppel/base/core/thrown.h"
#include "doppel/lab/recording/run_files.h"
#include "doppel/lab/recording/run_journal.h"
#include "doppel/lab/resimulation/detail/message_comparison.h"
#include "doppel/lab/resimulation/detail/own_names.h"
#include "doppel/ros/bus/parameter_services.h"
#include "doppel/ros/bus/rosout.h"
#include "doppel/twin/journal/input_journal.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using doppel_msgs::msg::Input;

constexpr std::chrono::seconds kOutcomeTime{60};  // in which work on another thread is complete

[[noreturn]] void refuse(const std::string& why, const std::string& fix) {
  throw InputError("bag.no_run", {}, "the recording cannot be run again: " + why, fix);
}

constexpr const char* kHowToRecord = "record the run from its start with: doppel up TARGET --record FOLDER";

// A topic whose messages may be in two recordings, of which the second one goes on where the first ends.
template <Message M>
class NumberedMessages {
 public:
  explicit NumberedMessages(const char* topic) : topic_(topic) {}

  void read(BagReader& bag) {
    bag.seek(0, UINT64_MAX, {.topics = {topic_}, .hidden = true});
    while (const auto message = bag.next()) {
      if (message->sequence <= last_) continue;
      if (const Status status = from_cdr(message->data, values.emplace_back()); !status)
        refuse(fmt::format("a message of {} is damaged: {}", topic_, status.why()), "doppel bag check FILE");
      lost += message->sequence - last_ - 1;
      last_ = message->sequence;
    }
  }

  std::vector<M> values;
  std::uint64_t lost = 0;

 private:
  const char* topic_;
  std::uint32_t last_ = 0;
};

std::string value_of(const std::vector<std::pair<std::string, std::string>>& texts, std::string_view key) {
  const auto found = std::ranges::find_if(texts, [key](const auto& entry) { return entry.first == key; });
  return found == texts.end() ? "" : found->second;
}

std::vector<std::pair<std::string, std::string>> texts_of(BagReader& bag, std::string_view name) {
  for (const BagPart& part : bag.contents().metadata) {
    if (part.part.name == name) return bag.metadata(part);
  }
  return {};
}

std::vector<std::byte> bytes_of(const Input& input) {
  std::vector<std::byte> out(input.data.size());
  std::ranges::transform(input.data, out.begin(), [](std::uint8_t byte) { return std::byte{byte}; });
  return out;
}

// Repeats the inputs, and compares the hashes.
class Replay {
 public:
  Replay(Twin& twin, const RecordedRun& run, Resimulation& out)
      : twin_(twin),
        run_(run),
        out_(out),
        edge_(twin.bus().attach("resimulation")),
        around_(twin.bus().names()) {
    twin.bus().hold_outcomes();
  }

  // Before a step: those that acted after this many steps, each batch between two steps of its own.
  void act() {
    while (is_due()) {
      const std::uint64_t batch = run_.inputs[next_].batch;
      for (; is_due() && run_.inputs[next_].batch == batch; ++next_) repeat(run_.inputs[next_]);
      if (is_due()) twin_.between_steps();
    }
  }
  [[nodiscard]] bool is_due() const {
    return next_ < run_.inputs.size() && run_.inputs[next_].step <= twin_.steps_taken();
  }

  void compare_hash() {
    while (hash_ < run_.hashes.size() && run_.hashes[hash_].step < twin_.steps_taken()) ++hash_;
    if (hash_ == run_.hashes.size() || run_.hashes[hash_].step != twin_.steps_taken()) return;
    ++out_.compared;
    if (run_.hashes[hash_].hash == twin_.state_hash()) {
      out_.equal_until = twin_.steps_taken();
    } else if (!out_.wrong_after) {
      out_.wrong_after = twin_.steps_taken();
    }
  }

 private:
  void fail(const Input& input, const std::string& why) {
    out_.failed_inputs.push_back(fmt::format("step {}: {} {}", input.step, input.target, why));
  }

  void repeat(const Input& input) {
    if (run_.scenario.wall_stamps) {
      edge_->post([this, &input] { twin_.bus().set_stamp_offset(Duration(input.stamp_offset)); });
    }
    switch (input.kind) {
      case Input::MESSAGE:
        return repeat_message(input);
      case Input::CALL:
        return repeat_call(input);
      case Input::PARAMETER:
        return repeat_parameter(input);
      case Input::OUTCOME:
        return edge_->post([this, &input] { await(input); });
      case Input::EDIT:
        return edge_->post([this, &input] { edit(input); });
      default:
        return fail(input, "is an input of another version of doppel");
    }
  }

  void repeat_message(const Input& input) {
    if (const Status sent = edge_->publish(input.source, input.target, input.type, bytes_of(input)); !sent)
      fail(input, sent.why());
  }

  void repeat_call(const Input& input) {
    if (around_.has(input.target)) return;
    edge_->call(input.target, bytes_of(input), [this, &input](const Status& status, const Bytes&) {
      // Refusals were refused in the recorded run, too; a service that does not exist was there.
      if (!status && status.why().starts_with("there is no service")) fail(input, status.why());
    });
  }

  void repeat_parameter(const Input& input) {
    rcl_interfaces::msg::ParameterValue value;
    if (const Status status = from_cdr(bytes_of(input), value); !status) return fail(input, status.why());
    edge_->set_parameter(input.target, input.type, from_msg(value), [](const Status&) {});
  }

  void await(const Input& input) {
    if (!twin_.bus().run_outcome(input.target, kOutcomeTime)) fail(input, "has not come to an end");
  }

  // An edit that was refused is refused again.
  void edit(const Input& input) {
    doppel_msgs::msg::EditedFiles edited;
    if (const Status status = from_cdr(bytes_of(input), edited); !status) return fail(input, status.why());
    try {
      for (const auto& file : edited.files) {
        const auto place = path_below(file.path, run_.root);
        if (!place)
          return fail(input, fmt::format("the edited file {} is outside of the recorded ones", file.path));
        const fs::path path = run_.folder / *place;
        std::error_code error;
        if (file.removed) {
          fs::remove(path, error);
          continue;
        }
        fs::create_directories(path.parent_path(), error);
        write_whole(path, {reinterpret_cast<const char*>(file.data.data()), file.data.size()});
      }
      Diagnostics diagnostics;
      twin_.replace(Twin::prepare(twin_.running(), diagnostics));
    } catch (const InputError& refused) {
      fail(input, refused.what());
    }
  }

  Twin& twin_;
  const RecordedRun& run_;
  Resimulation& out_;
  std::unique_ptr<Edge> edge_;
  const ServicesAround around_;
  std::size_t next_ = 0, hash_ = 0;
};

void run_again(Twin& twin, const RecordedRun& run, const ResimulationOptions& options, const Log& log,
               Resimulation& out) {
  std::optional<BusRecorder> recorder;
  if (options.record) recorder.emplace(twin.bus(), options.record(twin), log);
  std::optional<MessageComparison> messages;
  if (options.compare_with != nullptr)
    messages.emplace(twin.bus(), *options.compare_with, run.scenario.sensors.lockstep, run.first_step);
  const Rosout standard(twin.bus());  // makes /doppel a node as ROS 2's, whose services tools of ROS call
  twin.keep_states(run.keeps_states);
  Replay replay(twin, run, out);
  const std::uint64_t last = run.hashes.back().step;
  HeadlessOptions headless;
  headless.cancel = options.cancel;
  headless.until = [&](Twin&) {
    if (twin.steps_taken() >= last) return true;
    replay.act();
    if (recorder) recorder->let_catch_up();
    return false;
  };
  headless.observers.emplace_back([&](Twin&) {
    replay.compare_hash();
    if (messages) messages->look(twin.steps_taken(), twin.now());
    if (options.progress && twin.steps_taken() % 1000 == 0)
      options.progress(static_cast<double>(twin.steps_taken()) / static_cast<double>(last));
  });
  while (true) {
    Diagnostics start = std::move(out.run.diagnostics);
    out.run = run_headless(twin, headless);
    out.run.diagnostics = std::move(start);
    // A run goes on after a divergence where an input has reset it.
    if (out.run.end != RunEnd::diverged || !replay.is_due()) break;
    replay.act();
    twin.between_steps();
    if (twin.diverged()) break;
  }
  if (messages) out.first = messages->first();
  if (recorder) recorder->stop();
}

}  // namespace

namespace {

// The inputs and hashes before those of the bag itself: the journal that the black box attaches.
std::optional<BagReader> journal_of(const std::map<std::string, std::vector<std::byte>>& attachments,
                                    const fs::path& folder) {
  const auto journal = attachments.find(kJournalAttachment);
  if (journal == attachments.end()) return std::nullopt;
  const fs::path file = folder / kJournalAttachment;
  write_whole(file, {reinterpret_cast<const char*>(journal->second.data()), journal->second.size()});
  return BagReader(file.string());
}

std::map<std::string, std::vector<std::byte>> attachments_of(BagReader& bag) {
  std::map<std::string, std::vector<std::byte>> out;
  for (const BagPart& part : bag.contents().attachments) out[part.part.name] = bag.attachment(part);
  return out;
}

void read_files(BagReader& bag, const fs::path& bundled_robots, const std::vector<std::string>& plugins,
                RecordedRun& out) {
  const auto attachments = attachments_of(bag);
  if (!attachments.contains(kScenarioAttachment)) refuse("it has no scenario", kHowToRecord);
  const ScenarioFile scenario = load_scenario(
      write_run_files(attachments, texts_of(bag, kFilesOfRunMetadata), out.folder), bundled_robots, plugins);
  report_changed_files(scenario, out.notes);
  if (scenario.scenario.hardware == HardwareUse::real)
    refuse(
        "it is of real hardware, whose motion no simulation repeats, and which a repeated run must not move",
        "doppel bag play shows it");
  out.scenario = scenario.scenario;
  const auto about = texts_of(bag, kRunMetadata);
  out.root = value_of(about, "root");
  out.version = value_of(about, "version");
  out.engine = value_of(about, "engine");
  out.keeps_states = value_of(about, kKeepsStates) == "yes";
}

}  // namespace

RecordedRun read_recorded_run(BagReader& bag, const fs::path& folder, const fs::path& bundled_robots,
                              const std::vector<std::string>& plugins) {
  RecordedRun out;
  out.folder = folder;
  NumberedMessages<Input> inputs(kInputsTopic);
  NumberedMessages<doppel_msgs::msg::StateHash> hashes(kStateHashTopic);
  std::optional<BagReader> journal = journal_of(attachments_of(bag), folder);
  if (journal) {
    inputs.read(*journal);
    hashes.read(*journal);
    NumberedMessages<doppel_msgs::msg::StateHash> recorded(kStateHashTopic);
    recorded.read(bag);
    if (!recorded.values.empty()) out.first_step = recorded.values.front().step;
  }
  inputs.read(bag);
  hashes.read(bag);
  read_files(bag, bundled_robots, plugins, out);
  out.inputs = std::move(inputs.values);
  out.hashes = std::move(hashes.values);
  out.lost_inputs = inputs.lost;
  if (out.hashes.empty())
    refuse(
        fmt::format("it has no hash of a state ({}), because it ended before its first messages were written",
                    kStateHashTopic),
        kHowToRecord);
  if (out.hashes.front().step != 1)
    refuse(fmt::format("it begins at step {}", out.hashes.front().step), kHowToRecord);
  return out;
}

Resimulation resimulate(const RecordedRun& run, const ResimulationOptions& options) {
  Resimulation out;
  try {
    const Log quiet;
    Twin twin(run.scenario, quiet, out.run.diagnostics);
    run_again(twin, run, options, quiet, out);
  } catch (const InputError& error) {
    out.run.errors = error.diagnostics();
  }
  return out;
}

}  // namespace doppel
