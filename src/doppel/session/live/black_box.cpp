#include "doppel/session/live/black_box.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <ctime>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/file_descriptor.h"
#include "doppel/base/core/guarded_thread.h"
#include "doppel/base/core/thrown.h"
#include "doppel/base/core/user_folders.h"
#include "doppel/lab/recording/run_files.h"
#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/ros/messages/rcl_interfaces.h"
#include "doppel/ros/messages/std_msgs.h"
#include "doppel/ros/messages/std_srvs.h"
#include "doppel/ros/record/bag_copy.h"
#include "doppel/ros/record/bag_reader.h"
#include "doppel/ros/server/announcement.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr const char* kBlackBox = "black_box";
constexpr const char* kMirror = "mirror";  // the log's origin of alarms of the mirror
constexpr const char* kAbout = "doppel_black_box";
constexpr std::string_view kRolling = "black_box-";           // and the process's number
constexpr const char* kSalvaged = "-killed";                  // behind the name of the box that copies them
constexpr std::chrono::seconds kRollingFile{10}, kQuiet{30};  // kQuiet: between two bags of one kind of cause
// On the disk, together at most 85 MB.
constexpr std::uint64_t kMaxRollingFile = std::uint64_t{9} << 20U, kMaxRolling = std::uint64_t{45} << 20U,
                        kMaxJournal = std::uint64_t{16} << 20U, kMaxFiles = std::uint64_t{24} << 20U,
                        kMaxMeshes = std::uint64_t{16} << 20U;
static_assert(kMaxRolling + kMaxJournal + kMaxFiles == std::uint64_t{85} << 20U && kMaxMeshes < kMaxFiles);
constexpr const char *kJournal = "journal", *kFiles = "files";  // within the folder of the rolling files
constexpr const char* kSnapshot = "snapshot";
constexpr const char* kNotRunAgain = "not_resimulated_because";
constexpr std::size_t kRing = std::size_t{8} << 20;
constexpr int kNiceness = 10;

const std::vector<std::string> kNotRecorded = {
    "sensor_msgs/msg/Image",      "sensor_msgs/msg/CompressedImage", "sensor_msgs/msg/PointCloud2",
    "sensor_msgs/msg/CameraInfo", "sensor_msgs/msg/LaserScan",       "sensor_msgs/msg/Range"};

// "2026_11_27-21_05_30-emergency_stop"; what is no letter or digit becomes an underscore.
std::string bag_name(const std::string& cause) {
  constexpr std::size_t kMaxCause = 40;
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  localtime_r(&now, &parts);
  char text[64];
  std::strftime(text, sizeof text, "%Y_%m_%d-%H_%M_%S-", &parts);
  std::string out = text;
  for (const char c : cause.substr(0, kMaxCause))
    out += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  while (out.ends_with('_')) out.pop_back();
  return out;
}

// The name with a number behind the highest one that exists: the oldest bags are removed first, so that no
// name is that of a bag which somebody was given before.
fs::path unused_path(const fs::path& preferred) {
  const std::string name = preferred.filename().string() + "_";
  int highest = fs::exists(preferred) ? 1 : 0;
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(preferred.parent_path(), none)) {
    const std::string other = entry.path().filename().string();
    int number = 0;
    if (!other.starts_with(name)) continue;
    const auto [end, error] =
        std::from_chars(other.data() + name.size(), other.data() + other.size(), number);
    if (error == std::errc() && end == other.data() + other.size()) highest = std::max(highest, number);
  }
  return highest == 0 ? preferred : fs::path(preferred.string() + fmt::format("_{}", highest + 1));
}

// The scratch is checked before anything is looked for in it, because another user may have made it. The
// folder is made at once, so that two boxes of one process do not choose the same.
fs::path made_rolling_folder(const fs::path& scratch) {
  if (const std::string problem = make_private_folder(scratch); !problem.empty())
    throw InputError("black_box.folder", {}, problem, "remove it, or set XDG_RUNTIME_DIR");
  const std::string preferred = (scratch / fmt::format("{}{}", kRolling, getpid())).string();
  fs::path out = preferred;
  std::error_code error, none;
  for (int number = 2; !fs::create_directory(out, error); ++number) {
    if (error && !fs::exists(out, none)) {
      throw InputError("output.unwritable", {},
                       fmt::format("the folder '{}' cannot be made: {}", out.string(), error.message()));
    }
    out = preferred + fmt::format("_{}", number);
  }
  return out;
}

// The manager's sentences about commands that it has limited.
bool is_limit_episode(std::string_view text) {
  const bool is_command = text.find(": command ") != std::string_view::npos ||
                          text.find("position command requires") != std::string_view::npos;
  return is_command &&
         (text.find("limit") != std::string_view::npos || text.find("held there") != std::string_view::npos);
}

template <Message M>
std::optional<M> decoded(McapBytes cdr) {
  M out;
  return from_cdr(cdr, out) ? std::optional(std::move(out)) : std::nullopt;
}

// The process of a rolling folder; 0: it is none.
pid_t process_of(const fs::path& folder) {
  const std::string name = folder.filename().string();
  if (!name.starts_with(kRolling)) return 0;
  pid_t out = 0;
  std::from_chars(name.data() + kRolling.size(), name.data() + name.size(), out);
  return out;
}

// Throws InputError, also where another twin keeps the folder locked.
std::unique_ptr<BagWriter> new_bag(const fs::path& folder, const std::string& cause,
                                   std::chrono::milliseconds lock_timeout) {
  std::error_code none;
  fs::create_directories(folder, none);
  // Twins that write at the same time choose names and make folders one after another.
  const FolderLock lock(folder, lock_timeout);
  BagWriterOptions options;
  options.folder = unused_path(folder / bag_name(cause.substr(0, cause.find(':'))));
  options.distro = to_string(ros_distro());
  return std::make_unique<BagWriter>(options);
}

// The first reason why a bag cannot be run again stays.
void add_reason(std::vector<std::pair<std::string, std::string>>& about, const std::string& reason) {
  if (std::ranges::none_of(about, [](const auto& entry) { return entry.first == kNotRunAgain; }))
    about.emplace_back(kNotRunAgain, reason);
}

// The files and meshes of the run are added if they are complete, else the reason to `about`.
void add_files(const fs::path& rolling, BagWriter& bag,
               std::vector<std::pair<std::string, std::string>>& about) {
  if (!fs::exists(rolling / kFiles / kBagMetadataFile))
    return add_reason(about, "the files of the run had not been read yet");
  BagReader files((rolling / kFiles).string());
  copy_parts(files, bag);
}

bool has_recording(const fs::path& rolling) {
  bool out = false;
  for (const fs::directory_entry& entry : fs::directory_iterator(rolling)) {
    if (entry.path().extension() != ".mcap") continue;
    if (entry.file_size() == 0) {
      fs::remove(entry.path());  // its process was killed, or its disk was full, before the first byte
    } else {
      out = true;
    }
  }
  return out;
}

// Copies what is whole of the files of a process that was killed. Empty: there was no message. Throws where
// it cannot be copied as a whole.
fs::path recovered(const fs::path& rolling, const BlackBoxOptions& options) {
  if (!has_recording(rolling)) return {};
  BagReader bag(rolling.string());
  if (bag.contents().messages == 0) return {};
  const std::unique_ptr<BagWriter> copy = new_bag(options.folder, "killed", options.lock_timeout);
  try {
    if (const auto journal = journal_attachment(rolling / kJournal))
      copy->attach(*journal, bag.contents().end);
    std::vector<std::pair<std::string, std::string>> about = {{"cause", "killed"}};
    add_files(rolling, *copy, about);
    copy->add_metadata(kAbout, about);
    copy_from(bag, 0, UINT64_MAX, {.hidden = true}, *copy);
    copy->close();
  } catch (...) {
    copy->discard();
    throw;
  }
  return copy->folder();
}

// Without the meshes that do not fit, and without all other files if they do not.
std::vector<std::pair<std::string, std::string>> bound(RunFiles& files) {
  std::vector<std::pair<std::string, std::string>> out;
  if (!files.omitted.empty()) out.emplace_back("meshes_left_out", std::to_string(files.omitted.size()));
  std::uint64_t size = 0;
  for (const BagAttachment& attachment : files.attachments) size += attachment.data.size();
  if (size <= kMaxFiles) return out;
  std::erase_if(files.attachments, [](const BagAttachment& one) { return one.media_type != kMeshMediaType; });
  files.places.clear();
  out.emplace_back(kNotRunAgain, fmt::format("the files of the run are more than {} MB", kMaxFiles >> 20U));
  return out;
}

void remove_oldest(std::vector<fs::path> bags, std::size_t left) {
  std::error_code none;
  // They are sorted by time: bags of one second have numbers in their names, and "_10" comes before "_2".
  const auto time_of = [](const fs::path& bag) {
    std::error_code ignored;
    return std::pair(fs::last_write_time(bag, ignored), bag);
  };
  std::ranges::sort(bags, {}, time_of);
  for (std::size_t i = 0; i + left < bags.size(); ++i) fs::remove_all(bags[i], none);
}

}  // namespace

BlackBoxOptions default_black_box() {
  BlackBoxOptions out;
  out.scratch = announcement_folder();
  if (const fs::path state = state_folder(); !state.empty()) out.folder = state / "black_box";
  return out;
}

BlackBox::BlackBox(Twin& twin, BlackBoxOptions options, const Log& log)
    : twin_(twin),
      options_(std::move(options)),
      log_(log),
      rolling_(made_rolling_folder(options_.scratch)),
      node_(twin.bus(), "/doppel"),
      parameters_(twin.bus()) {
  node_.serve<std_srvs::srv::Trigger>(
      "~/snapshot", [this](const auto&, const Responder<std_srvs::srv::Trigger::Response>& respond) {
        write(kSnapshot, [this, respond](const fs::path& bag, const std::string& failure) {
          twin_.bus().post([respond, bag, failure] {
            respond({failure.empty(), failure.empty() ? bag.string() : failure});
          });
        });
      });
  RecorderOptions recording;
  recording.bag.folder = rolling_;
  recording.bag.is_folder_made = true;
  recording.bag.distro = to_string(ros_distro());
  recording.bag.max_file_time = kRollingFile;
  recording.bag.max_file_size = kMaxRollingFile;
  recording.topics = {.all = true, .exclude_types = kNotRecorded};
  for (const RigStatus& sensor : twin.sensors()) {
    for (const std::string& topic : sensor.sensor.topics) recording.topics.exclude_topics.push_back(topic);
  }
  recording.ring_bytes = kRing;
  recording.keep = options_.length + options_.afterwards;
  recording.keep_bytes = kMaxRolling;
  recording.listed = false;
  recording.niceness = kNiceness;
  recording.on_message = [this](const BagTopicCount& topic, const Edge::Incoming& message) {
    look(topic, message);
  };
  recording.on_look = [this] {
    if (journal_) journal_->look(Clock::now());
    write_due();
  };
  recording.on_failure = [this](const std::string& why) {
    log_.warning(kBlackBox, fmt::format("the last seconds are not kept any more: {}", why));
  };
  recorder_.emplace(twin.bus(), std::move(recording), log);
  // A start does not wait for the disk.
  reader_ = guarded_thread(
      [this, sources = run_sources(twin)] {
        try {
          read_files(sources);
        } catch (const InputError& error) {
          log_.warning(kBlackBox, fmt::format("the files of the run are not kept: {}", error.what()));
        }
        salvage();
      },
      [&log](const std::string& why) { log.note(kBlackBox, why); });
}

BlackBox::~BlackBox() {
  if (reader_.joinable()) reader_.join();
  ending_ = true;
  recorder_->stop();
  std::error_code none;
  fs::remove_all(rolling_, none);
}

// Into a bag of their own, from which they are copied to each bag, also by the next process.
void BlackBox::read_files(const RunSources& sources) {
  RunFiles files = run_files(sources, options_.version, kMaxMeshes);
  files.about.emplace_back(kKeepsStates, options_.keeps_states ? "yes" : "no");
  std::vector<std::pair<std::string, std::string>> about = bound(files);
  about.insert(about.begin(), files.about.begin(), files.about.end());
  {
    const std::lock_guard lock(about_mutex_);
    about_ = std::move(about);
  }
  BagWriterOptions options;
  options.folder = rolling_ / kFiles;
  BagWriter bag(options);
  for (const BagAttachment& attachment : files.attachments) bag.attach(attachment, 0);
  bag.add_metadata(kFilesOfRunMetadata, files.places);
  bag.add_metadata(kRunMetadata, files.about);
  bag.close();
}

// Files of processes that do not exist any more. Of several twins that start one gets a folder, by its new
// name: it begins with that of this box, so that no other box chooses it.
void BlackBox::salvage() {
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(options_.scratch, none)) {
    const pid_t process = process_of(entry.path());
    if (process == 0 || process == getpid() || kill(process, 0) == 0 || errno != ESRCH) continue;
    const fs::path renamed = unused_path(rolling_.string() + kSalvaged);
    std::error_code error;
    fs::rename(entry.path(), renamed, error);
    if (!error) copy_killed(renamed);
  }
}

// A folder that cannot be copied stays, and the next start after this process tries again.
void BlackBox::copy_killed(const fs::path& rolling) {
  try {
    const fs::path bag = recovered(rolling, options_);
    std::error_code none;
    fs::remove_all(rolling, none);
    if (!bag.empty())
      log_.note(kBlackBox,
                fmt::format("an earlier twin was killed; its last seconds are in {}", bag.string()));
  } catch (...) {
    log_.warning(
        kBlackBox,
        fmt::format("an earlier twin was killed; its last seconds could not be copied and stay in {}: {}",
                    rolling.string(), thrown_text()));
  }
}

void BlackBox::look(const BagTopicCount& topic, const Edge::Incoming& message) {
  if (!journal_) journal_.emplace(rolling_ / kJournal, std::string(to_string(ros_distro())), kMaxJournal);
  journal_->write(topic, message);
  if (topic.name == "/parameter_events") {
    if (const auto event = decoded<rcl_interfaces::msg::ParameterEvent>(message.cdr))
      parameters_.apply(*event);
  }
  if (topic.name == "/rosout") {
    const auto line = decoded<rcl_interfaces::msg::Log>(message.cdr);
    if (!line || line->name == kBlackBox) return;
    if (line->level >= rcl_interfaces::msg::Log::ERROR)
      notice(fmt::format("error: {}: {}", line->name, line->msg));
    if (line->level == rcl_interfaces::msg::Log::WARN && is_limit_episode(line->msg))
      notice("limit: " + line->msg);
    if (line->level == rcl_interfaces::msg::Log::WARN && line->name == kMirror)
      notice("mirror: " + line->msg);
  } else if (topic.name.ends_with("/emergency_stop_active")) {
    const auto stop = decoded<std_msgs::msg::Bool>(message.cdr);
    bool& stopped = stopped_[topic.name];
    if (stop && stop->data && !stopped) notice("emergency stop: " + topic.name);
    stopped = stop && stop->data;
  } else if (topic.name == "/doppel/status") {
    const auto status = decoded<doppel_msgs::msg::TwinStatus>(message.cdr);
    const bool diverged = status && !status->divergence.empty();
    if (diverged && !diverged_) notice("divergence: " + status->divergence);
    diverged_ = diverged;
  }
}

// Causes of one kind that follow each other are in one bag.
void BlackBox::notice(const std::string& cause) {
  const WallTime now = Clock::now();
  const std::string kind = cause.substr(0, cause.find(':'));
  const auto before = noticed_.find(kind);
  if (before != noticed_.end() && now - before->second < kQuiet) return;
  noticed_[kind] = now;
  pending_.push_back({cause, now + options_.afterwards});
}

void BlackBox::write_due() {
  // At the end of the run nothing follows.
  while (!pending_.empty() && (ending_ || pending_.front().due <= Clock::now())) {
    const std::string cause = pending_.front().cause;
    pending_.erase(pending_.begin());
    write(cause, {});
  }
}

void BlackBox::write(const std::string& cause, const Done& done) {
  const auto bag = std::make_shared<fs::path>();
  const auto is_begun = std::make_shared<bool>(false);
  BusRecorder::Copy copy;
  copy.make_bag = [this, cause, bag, is_begun] {
    *is_begun = true;
    auto out = new_bag(options_.folder, cause, options_.lock_timeout);
    *bag = out->folder();
    return out;
  };
  copy.last = options_.length + options_.afterwards;
  // A client whose request is refused can repeat it; what has happened to the twin is reported once.
  copy.is_urgent = cause != kSnapshot;
  copy.add_parts = [this, cause](BagWriter& writer, std::uint64_t time) { add_parts(cause, writer, time); };
  copy.done = [this, bag, is_begun, cause, done](const std::string& failure) {
    if (failure.empty()) {
      log_.note(kBlackBox, fmt::format("{}: the last {:.0f} s are in {}", cause, to_seconds(options_.length),
                                       bag->string()));
      remove_old();
    } else if (*is_begun || !done) {
      // A refused request is in its client's answer alone: a line for each would fill the log.
      log_.warning(kBlackBox, fmt::format("{}: the last seconds could not be written: {}", cause, failure));
    }
    if (done) done(*bag, failure);
  };
  recorder_->copy(std::move(copy));
}

// The recorder's thread.
void BlackBox::add_parts(const std::string& cause, BagWriter& bag, std::uint64_t time) {
  std::vector<std::pair<std::string, std::string>> about;
  {
    const std::lock_guard lock(about_mutex_);
    about = about_;
  }
  about.emplace_back("cause", cause);
  if (journal_) journal_->flush();
  if (journal_ && !journal_->end().empty()) {
    add_reason(about, journal_->end());
  } else if (const auto journal = journal_attachment(rolling_ / kJournal)) {
    bag.attach(*journal, time);
  }
  add_files(rolling_, bag, about);
  const std::string parameters = parameters_.text();
  const auto* const text = reinterpret_cast<const std::byte*>(parameters.data());
  bag.attach({"parameters.yaml", "application/yaml", {text, text + parameters.size()}}, time);
  bag.add_metadata(kAbout, about);
}

// A client that asks again and again does not remove what an incident has left.
void BlackBox::remove_old() const {
  std::error_code none;
  std::vector<fs::path> causes, snapshots;
  for (const fs::directory_entry& entry : fs::directory_iterator(options_.folder, none)) {
    const bool is_snapshot =
        entry.path().filename().string().find(fmt::format("-{}", kSnapshot)) != std::string::npos;
    (is_snapshot ? snapshots : causes).push_back(entry.path());
  }
  remove_oldest(std::move(causes), options_.max_bags);
  remove_oldest(std::move(snapshots), options_.max_snapshots);
}

}  // namespace doppel
