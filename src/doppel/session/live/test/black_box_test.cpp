// The black box: what it writes, when, and what it leaves behind.
#include "doppel/session/live/black_box.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <set>
#include <thread>
#include <utility>

#include "doppel/base/core/file_descriptor.h"
#include "doppel/base/core/user_folders.h"
#include "doppel/lab/headless_run/headless_run.h"
#include "doppel/lab/resimulation/resimulation.h"
#include "doppel/ros/bus/parameter_file.h"
#include "doppel/ros/bus/rosout.h"
#include "doppel/ros/messages/std_srvs.h"
#include "doppel/ros/messages/trajectory_msgs.h"
#include "doppel/ros/record/bag_reader.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;
using testing::SizeIs;

constexpr pid_t kNoProcess = 0x7fff0000;  // beyond the largest number of a process

class BlackBoxTest : public testing::Test {
 protected:
  BlackBoxTest() {
    fs::remove_all(folder_);
    options_.scratch = folder_ / "run";
    options_.folder = folder_ / "state";
    options_.afterwards = 100ms;
    options_.version = "1.2.3";
    fs::create_directories(options_.scratch.parent_path());
    EXPECT_EQ(make_private_folder(options_.scratch), "");
    log_.add_sink([this](const LogLine& line) {
      const std::lock_guard lock(mutex_);
      lines_.push_back(line.text);
    });
    twin_.emplace(scenario_of("omarm_zero"), log_, diagnostics_);
    rosout_.emplace(twin_->bus());
    log_.add_sink(rosout_->sink());
  }
  ~BlackBoxTest() override { fs::remove_all(folder_); }

  static Scenario scenario_of(const std::string& robot) {
    Scenario out;
    out.bundled_robots = DOPPEL_SOURCE_DIR "/robots";
    out.robots = {{.target = robot}};
    return out;
  }
  // Steps until a condition holds, for as long as a slow machine needs.
  template <class Condition>
  void step_until(Condition condition) {
    for (int i = 0; i < 3000 && !condition(); ++i) {
      run_headless(*twin_, {.duration = from_seconds(0.01)});
      std::this_thread::sleep_for(10ms);
    }
  }
  // The same without steps.
  template <class Condition>
  static bool wait_until(Condition condition) {
    const auto end = std::chrono::steady_clock::now() + 60s;
    while (!condition()) {
      if (std::chrono::steady_clock::now() > end) return false;
      std::this_thread::sleep_for(10ms);
    }
    return true;
  }
  // The folder of the rolling files, while there is one box.
  fs::path rolling() const { return options_.scratch / ("black_box-" + std::to_string(getpid())); }
  // The files of the run are read on a thread of their own; without them a bag is not run again.
  bool has_files_of_run() const {
    return wait_until([this] { return fs::exists(rolling() / "files" / "metadata.yaml"); });
  }
  // The bytes of the recorder's files and of the journal's.
  std::uint64_t recorded_bytes() const {
    std::uint64_t out = 0;
    for (const fs::path& folder : {rolling(), rolling() / "journal"}) {
      std::error_code none;
      for (const fs::directory_entry& entry : fs::directory_iterator(folder, none)) {
        if (entry.path().extension() != ".mcap") continue;
        const std::uintmax_t size = fs::file_size(entry.path(), none);
        if (!none) out += size;
      }
    }
    return out;
  }
  // Steps, so that the files grow once more, and waits until they stay equal for two flushes.
  bool is_written_after_steps() {
    constexpr auto kTwoFlushes = 1000ms;
    const std::uint64_t before = recorded_bytes();
    run_headless(*twin_, {.duration = from_seconds(0.1)});
    std::uint64_t last = before;
    auto since = std::chrono::steady_clock::now();
    return wait_until([&] {
      const std::uint64_t present = recorded_bytes();
      if (std::exchange(last, present) != present) since = std::chrono::steady_clock::now();
      return present > before && std::chrono::steady_clock::now() - since > kTwoFlushes;
    });
  }
  std::vector<fs::path> bags_after_steps() {
    step_until([this] { return fs::exists(options_.folder) && !lines().empty(); });
    return bags();
  }
  // Asks for a snapshot; the answer comes while the twin steps.
  using Answer = std::optional<std_srvs::srv::Trigger::Response>;
  static std::shared_ptr<Answer> ask(Edge& edge) {
    const auto out = std::make_shared<Answer>();
    edge.call("/doppel/snapshot", to_cdr(std_srvs::srv::Trigger::Request{}),
              [out](const Status& status, const Bytes& cdr) {
                EXPECT_TRUE(status) << status.why();
                EXPECT_TRUE(from_cdr(cdr, out->emplace()));
              });
    return out;
  }
  std_srvs::srv::Trigger::Response snapshot() {
    const auto edge = twin_->bus().attach("client");
    const auto answer = ask(*edge);
    step_until([&] { return answer->has_value(); });
    EXPECT_TRUE(*answer) << "no answer";
    return answer->value_or(std_srvs::srv::Trigger::Response{});
  }
  static std::string name_of_killed(int number) { return "black_box-" + std::to_string(kNoProcess + number); }
  // Files as a process leaves them that was killed.
  fs::path leave_killed(int number) const {
    const fs::path out = options_.scratch / name_of_killed(number);
    BagWriterOptions bag;
    bag.folder = out;
    BagWriter writer(bag);
    RecordedTopic topic;
    topic.name = "/a";
    topic.type = "std_msgs/msg/String";
    writer.write(writer.add_topic(topic), 1, 1, 1, Bytes(12));
    writer.close();
    fs::remove(out / "metadata.yaml");
    const fs::path file = out / (out.filename().string() + "_0.mcap");
    fs::resize_file(file, fs::file_size(file) - 20);
    return out;
  }
  bool has_line(const std::string& text) {
    const std::lock_guard lock(mutex_);
    return std::ranges::any_of(lines_,
                               [&](const std::string& line) { return line.find(text) != std::string::npos; });
  }
  std::vector<fs::path> bags() const {
    std::vector<fs::path> out;
    std::error_code none;
    for (const fs::directory_entry& entry : fs::directory_iterator(options_.folder, none))
      out.push_back(entry.path());
    std::ranges::sort(out);
    return out;
  }
  // The lines of the black box.
  std::vector<std::string> lines() {
    const std::lock_guard lock(mutex_);
    std::vector<std::string> out;
    for (const std::string& line : lines_) {
      if (line.find("are in") != std::string::npos) out.push_back(line);
    }
    return out;
  }
  static std::vector<std::pair<std::string, std::string>> about(const fs::path& bag) {
    BagReader reader(bag.string());
    for (const BagPart& part : reader.contents().metadata) {
      if (part.part.name == "doppel_black_box") return reader.metadata(part);
    }
    return {};
  }
  static std::uint64_t messages(const fs::path& bag, const std::string& topic) {
    const BagReader reader(bag.string());
    for (const BagTopic& one : reader.contents().topics) {
      if (one.name == topic) return one.messages;
    }
    return 0;
  }

  const fs::path folder_ =
      fs::path(testing::TempDir()) /
      (std::string("black_box_") + testing::UnitTest::GetInstance()->current_test_info()->name());
  BlackBoxOptions options_;
  std::mutex mutex_;
  std::vector<std::string> lines_;
  Log log_;
  Diagnostics diagnostics_;
  std::optional<Twin> twin_;
  std::optional<Rosout> rosout_;
};

TEST_F(BlackBoxTest, EmergencyStopIsWrittenWithCauseScenarioAndLatchedTopics) {
  const BlackBox box(*twin_, options_, log_);
  run_headless(*twin_, {.duration = from_seconds(1)});
  twin_->robot().controller_manager().stop("the test");
  const std::vector<fs::path> found = bags_after_steps();
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_THAT(found[0].filename().string(), HasSubstr("emergency_stop"));
  EXPECT_THAT(about(found[0]), Contains(Pair("cause", HasSubstr("emergency stop"))));
  EXPECT_THAT(about(found[0]), Contains(Pair("version", "1.2.3")));
  EXPECT_EQ(messages(found[0], "/robot_description"), 1U);
  EXPECT_EQ(messages(found[0], "/tf_static"), 1U);
  EXPECT_GT(messages(found[0], "/joint_states"), 50U);
  const BagReader reader(found[0].string());
  EXPECT_THAT(reader.contents().attachments, testing::Not(IsEmpty()));
  EXPECT_THAT(reader.contents().notes, IsEmpty());
}

TEST_F(BlackBoxTest, CommandBeyondLimitIsCause) {
  const BlackBox box(*twin_, options_, log_);
  run_headless(*twin_, {.duration = from_seconds(0.2)});
  const auto edge = twin_->bus().attach("client");
  trajectory_msgs::msg::JointTrajectory command;
  command.joint_names = twin_->robot().model().driven_joint_names();
  for (const TopicInfo& topic : twin_->bus().topics()) {
    if (!topic.name.ends_with("/joint_trajectory")) continue;
    auto& point = command.points.emplace_back();
    point.positions.assign(command.joint_names.size(), 1.0);
    point.time_from_start = to_duration_msg(from_seconds(0.001));
    static_cast<void>(edge->publish("/client", topic.name, command.kType, to_cdr(command)));
    break;
  }
  const std::vector<fs::path> found = bags_after_steps();
  ASSERT_THAT(found, SizeIs(1)) << testing::PrintToString(lines_);
  EXPECT_THAT(found[0].filename().string(), HasSubstr("limit"));
}

TEST_F(BlackBoxTest, ErrorOfLogIsCauseOnceInHalfMinute) {
  const BlackBox box(*twin_, options_, log_);
  run_headless(*twin_, {.duration = from_seconds(0.2)});
  log_.error("arm", "something broke");
  log_.error("arm", "something broke again");
  ASSERT_THAT(bags_after_steps(), SizeIs(1));
  EXPECT_THAT(about(bags()[0]), Contains(Pair("cause", "error: arm: something broke")));
}

TEST_F(BlackBoxTest, SnapshotAnswersWithFolderOfBag) {
  const BlackBox box(*twin_, options_, log_);
  run_headless(*twin_, {.duration = from_seconds(0.5)});
  const auto [success, folder] = snapshot();
  EXPECT_TRUE(success) << folder;
  ASSERT_TRUE(fs::exists(fs::path(folder) / "metadata.yaml")) << folder;
  EXPECT_THAT(about(folder), Contains(Pair("cause", "snapshot")));
}

TEST_F(BlackBoxTest, ManySnapshotsKeepWholeSpan) {
  options_.length = from_seconds(2);
  const BlackBox box(*twin_, options_, log_);
  run_headless(*twin_, {.duration = from_seconds(3)});
  for (int i = 0; i < 12; ++i) {
    const auto [success, folder] = snapshot();
    ASSERT_TRUE(success) << folder;
    const BagReader bag(folder);
    EXPECT_GE(bag.contents().end - bag.contents().start, 1'900'000'000U) << "snapshot " << i;
  }
}

// Also beyond the number that is kept: the name of a bag that was removed is not given again.
TEST_F(BlackBoxTest, SnapshotsOfSameMomentHaveFoldersOfTheirOwn) {
  ASSERT_LT(options_.max_snapshots, 25);
  const BlackBox box(*twin_, options_, log_);
  run_headless(*twin_, {.duration = from_seconds(0.2)});
  const auto edge = twin_->bus().attach("client");
  std::vector<std::shared_ptr<Answer>> answers;
  for (int i = 0; i < 25; ++i) answers.push_back(ask(*edge));
  step_until([&] { return std::ranges::all_of(answers, [](const auto& one) { return one->has_value(); }); });
  std::set<std::string> folders;
  for (const auto& answer : answers) {
    ASSERT_TRUE(*answer);
    EXPECT_TRUE((*answer)->success) << (*answer)->message;
    folders.insert((*answer)->message);
  }
  EXPECT_THAT(folders, SizeIs(25));
}

TEST_F(BlackBoxTest, CauseIsWrittenBeforeSnapshotsThatFillQueue) {
  constexpr std::ptrdiff_t kBeyond = 8;
  constexpr auto kRequests = static_cast<std::ptrdiff_t>(BusRecorder::kMaxRequests) + kBeyond;
  options_.afterwards = 0ms;
  options_.lock_timeout = 60s;
  fs::create_directories(options_.folder);
  // Each copy takes this lock to choose its folder.
  const FileDescriptor folder(::open(options_.folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  ASSERT_EQ(flock(folder.get(), LOCK_EX), 0);
  const BlackBox box(*twin_, options_, log_);
  const auto edge = twin_->bus().attach("client");
  std::vector<std::shared_ptr<Answer>> answers = {ask(*edge)};
  const auto answered = [&answers] {
    return std::ranges::count_if(answers, [](const auto& answer) { return answer->has_value(); });
  };
  // The first request leaves the queue and waits for the lock; then the queue is filled.
  for (int i = 0; i < 30; ++i) {
    run_headless(*twin_, {.duration = from_seconds(0.01)});
    std::this_thread::sleep_for(10ms);
  }
  for (std::ptrdiff_t i = 0; i < kRequests; ++i) answers.push_back(ask(*edge));
  step_until([&] { return answered() >= kBeyond; });
  EXPECT_GE(answered(), kBeyond) << "expected refusals";
  twin_->robot().controller_manager().stop("the test");
  run_headless(*twin_, {.duration = from_seconds(0.1)});
  EXPECT_EQ(flock(folder.get(), LOCK_UN), 0);
  step_until([&] { return answered() == std::ssize(answers); });
  const std::vector<std::string> written = lines();
  {
    const std::lock_guard lock(mutex_);
    EXPECT_THAT(lines_, testing::Not(Contains(HasSubstr("requests wait already"))));
  }
  const auto is_stop = [](const std::string& line) { return line.starts_with("emergency stop: "); };
  const auto stop = std::ranges::find_if(written, is_stop);
  ASSERT_NE(stop, written.end()) << testing::PrintToString(written);
  EXPECT_LE(std::count_if(written.begin(), stop,
                          [](const std::string& line) { return line.starts_with("snapshot: "); }),
            1);
}

TEST_F(BlackBoxTest, BagWithoutFilesOfRunHasReasonWhyItIsNotRunAgain) {
  const BlackBox box(*twin_, options_, log_);
  ASSERT_TRUE(has_files_of_run());
  fs::remove(rolling() / "files" / "metadata.yaml");  // they would be incomplete without it
  run_headless(*twin_, {.duration = from_seconds(0.2)});
  const auto [success, folder] = snapshot();
  ASSERT_TRUE(success) << folder;
  EXPECT_THAT(about(folder), Contains(Pair("not_resimulated_because", HasSubstr("files of the run"))));
}

TEST_F(BlackBoxTest, SnapshotsRemoveNoBagOfCause) {
  options_.max_bags = 2;
  options_.max_snapshots = 2;
  for (const char* name : {"2020_a-emergency_stop", "2021_b-snapshot", "2022_c-snapshot_2"})
    fs::create_directories(options_.folder / name);
  const BlackBox box(*twin_, options_, log_);
  run_headless(*twin_, {.duration = from_seconds(0.2)});
  EXPECT_TRUE(snapshot().success);
  EXPECT_TRUE(snapshot().success);
  ASSERT_THAT(bags(), SizeIs(3));
  EXPECT_EQ(bags()[0].filename(), "2020_a-emergency_stop");
}

// The limit of a file's size stands in for a disk that is full.
TEST_F(BlackBoxTest, SnapshotIsAnsweredWithReasonWhenDiskIsFull) {
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const BlackBox box(*twin_, options_, log_);
  const rlimit small{2000, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  step_until([this] { return has_line("are not kept any more"); });
  const auto answer = snapshot();
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  EXPECT_TRUE(has_line("are not kept any more"));
  EXPECT_FALSE(has_line("the recording has ended"));
  EXPECT_FALSE(answer.success);
  EXPECT_THAT(answer.message, HasSubstr("cannot be written"));
  EXPECT_THAT(bags(), IsEmpty());
}

// A process that stands still has the lock, as after Ctrl-Z.
TEST_F(BlackBoxTest, SnapshotIsAnsweredWhereFolderStaysLocked) {
  options_.lock_timeout = 20ms;
  fs::create_directories(options_.folder);
  const FileDescriptor folder(::open(options_.folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  ASSERT_EQ(flock(folder.get(), LOCK_EX), 0);
  const BlackBox box(*twin_, options_, log_);
  EXPECT_THAT(snapshot().message, HasSubstr("the folder '" + options_.folder.string() + "' locked"));
  EXPECT_EQ(flock(folder.get(), LOCK_UN), 0);
  EXPECT_TRUE(snapshot().success) << "the box goes on";
}

TEST_F(BlackBoxTest, ScratchThatOthersCanAccessIsRefused) {
  fs::permissions(options_.scratch, fs::perms::owner_all | fs::perms::group_read);
  EXPECT_THAT([this] { const BlackBox box(*twin_, options_, log_); },
              testing::ThrowsMessage<InputError>(HasSubstr("only this user")));
  fs::remove_all(options_.scratch);
  fs::create_directories(folder_ / "elsewhere");
  fs::create_directory_symlink(folder_ / "elsewhere", options_.scratch);
  EXPECT_THAT([this] { const BlackBox box(*twin_, options_, log_); },
              testing::ThrowsMessage<InputError>(HasSubstr("only this user")));
  EXPECT_TRUE(fs::is_empty(folder_ / "elsewhere"));
}

TEST_F(BlackBoxTest, BagHasEveryMeshOfItsRobot) {
  rosout_.reset();  // of the other twin
  twin_.emplace(scenario_of("omarm_one"), log_, diagnostics_);
  const BlackBox box(*twin_, options_, log_);
  run_headless(*twin_, {.duration = from_seconds(0.2)});
  std::string folder;
  // The files of the run are read beside its first steps.
  for (int i = 0; i < 200 && (folder.empty() || BagReader(folder).contents().attachments.size() < 3); ++i)
    folder = snapshot().message;
  const BagReader bag(folder);
  std::set<std::string> attached;
  for (const BagPart& part : bag.contents().attachments) attached.insert(part.part.name);
  std::size_t meshes = 0;
  for (const Link& link : twin_->robot().description().links) {
    for (const Visual& visual : link.visuals) {
      const auto* const mesh = std::get_if<MeshGeometry>(&visual.geometry);
      if (mesh == nullptr) continue;
      ++meshes;
      EXPECT_TRUE(attached.contains(mesh->uri)) << mesh->uri;
    }
  }
  EXPECT_GT(meshes, 10U);
}

TEST_F(BlackBoxTest, MeshThatDoesNotFitIsLeftOutAndCounted) {
  fs::copy(DOPPEL_SOURCE_DIR "/robots/omarm_one", folder_ / "omarm_one", fs::copy_options::recursive);
  rosout_.reset();  // of the other twin
  twin_.emplace(scenario_of((folder_ / "omarm_one").string()), log_, diagnostics_);
  MeshGeometry large;
  for (const Link& link : twin_->robot().description().links) {
    for (const Visual& visual : link.visuals) {
      if (const auto* const mesh = std::get_if<MeshGeometry>(&visual.geometry)) large = *mesh;
    }
  }
  ASSERT_THAT(large.path, HasSubstr(folder_.string()));
  fs::resize_file(large.path, std::uintmax_t{25} << 20U);
  const BlackBox box(*twin_, options_, log_);
  ASSERT_TRUE(has_files_of_run());
  const auto [success, folder] = snapshot();
  ASSERT_TRUE(success) << folder;
  EXPECT_THAT(about(folder), Contains(Pair("meshes_left_out", "1")));
  EXPECT_THAT(about(folder), Contains(Pair("not_resimulated_because", HasSubstr("more than 24 MB"))));
  const BagReader bag(folder);
  std::set<std::string> attached;
  for (const BagPart& part : bag.contents().attachments) attached.insert(part.part.name);
  EXPECT_FALSE(attached.contains(large.uri));
  EXPECT_GT(attached.size(), 10U) << "the other meshes are there";
}

// Sends a trajectory, resets, and sends another one.
void drive(Twin& twin, double seconds) {
  const auto edge = twin.bus().attach("client");
  const auto send = [&](double position) {
    trajectory_msgs::msg::JointTrajectory command;
    command.joint_names = twin.robot().model().driven_joint_names();
    auto& point = command.points.emplace_back();
    point.positions.assign(command.joint_names.size(), position);
    point.time_from_start = to_duration_msg(from_seconds(0.5));
    static_cast<void>(edge->publish("/client", "/joint_trajectory_controller/joint_trajectory", command.kType,
                                    to_cdr(command)));
  };
  send(0.05);
  run_headless(twin, {.duration = from_seconds(seconds)});
  edge->call("/gazebo/reset_simulation", to_cdr(std_srvs::srv::Empty::Request{}),
             [](const Status&, const Bytes&) {});
  run_headless(twin, {.duration = from_seconds(0.3)});
  send(-0.04);
  run_headless(twin, {.duration = from_seconds(seconds)});
}

void expect_equal_again(const fs::path& bag, const fs::path& files) {
  fs::create_directories(files);
  BagReader reader(bag.string());
  const RecordedRun run = read_recorded_run(reader, files, DOPPEL_SOURCE_DIR "/robots");
  EXPECT_GE(run.inputs.size(), 3U);
  ResimulationOptions options;
  options.compare_with = &reader;
  const Resimulation result = resimulate(run, options);
  EXPECT_TRUE(result.equal());
  EXPECT_FALSE(result.first) << result.first->topic;
  EXPECT_GT(result.compared, 2U);
}

TEST_F(BlackBoxTest, BagIsRunAgainFromStartAndHasParameters) {
  options_.length = from_seconds(2);
  const BlackBox box(*twin_, options_, log_);
  ASSERT_TRUE(has_files_of_run());
  drive(*twin_, 4);
  log_.error("arm", "something broke");
  step_until([this] { return has_line("something broke: the last"); });
  std::vector<fs::path> found = bags();  // on a busy machine also one of a command beyond a limit
  std::erase_if(found, [](const fs::path& bag) { return !bag.filename().string().ends_with("-error"); });
  ASSERT_THAT(found, SizeIs(1));
  expect_equal_again(found[0], folder_ / "files");
  BagReader reader(found[0].string());
  EXPECT_LT(reader.contents().end - reader.contents().start, 4'000'000'000U);
  std::string parameters;
  for (const BagPart& part : reader.contents().attachments) {
    if (part.part.name != "parameters.yaml") continue;
    const std::vector<std::byte> data = reader.attachment(part);
    parameters.assign(reinterpret_cast<const char*>(data.data()), data.size());
  }
  EXPECT_THAT(parameters, HasSubstr("use_sim_time: true"));
  EXPECT_NO_THROW(ParameterFile::parse(parameters, "parameters.yaml"));
}

TEST_F(BlackBoxTest, BagOfKilledProcessIsRunAgain) {
  const fs::path dead = options_.scratch / name_of_killed(0);
  {
    const BlackBox box(*twin_, options_, log_);
    ASSERT_TRUE(has_files_of_run());
    drive(*twin_, 2);
    ASSERT_TRUE(is_written_after_steps());
    fs::copy(rolling(), dead, fs::copy_options::recursive);
  }
  fs::remove_all(options_.folder);
  const std::size_t before = lines().size();
  const BlackBox box(*twin_, options_, log_);
  for (int i = 0; i < 3000 && lines().size() == before; ++i) std::this_thread::sleep_for(10ms);
  ASSERT_THAT(bags(), SizeIs(1));
  EXPECT_THAT(about(bags()[0]), Contains(Pair("cause", "killed")));
  expect_equal_again(bags()[0], folder_ / "files");
}

TEST_F(BlackBoxTest, EndOfRunLeavesNoRollingFilesAndNoSubscribers) {
  {
    const BlackBox box(*twin_, options_, log_);
    run_headless(*twin_, {.duration = from_seconds(0.5)});
    EXPECT_FALSE(fs::is_empty(options_.scratch));
    for (const TopicInfo& topic : twin_->bus().topics()) {
      for (const EndpointInfo& subscriber : topic.subscribers) EXPECT_EQ(subscriber.edge, "") << topic.name;
    }
  }
  EXPECT_TRUE(fs::is_empty(options_.scratch));
  EXPECT_THAT(bags(), IsEmpty());
}

TEST_F(BlackBoxTest, FilesOfKilledProcessAreWrittenByNextOne) {
  const fs::path dead = leave_killed(0);
  const BlackBox box(*twin_, options_, log_);
  ASSERT_THAT(bags_after_steps(), SizeIs(1));
  EXPECT_THAT(bags()[0].filename().string(), HasSubstr("killed"));
  EXPECT_EQ(messages(bags()[0], "/a"), 1U);
  EXPECT_THAT(about(bags()[0]), Contains(Pair("not_resimulated_because", HasSubstr("files of the run"))));
  EXPECT_FALSE(fs::exists(dead));
}

TEST_F(BlackBoxTest, FilesOfKilledProcessStayWhereTheyCannotBeCopied) {
  leave_killed(0);
  std::ofstream(options_.folder) << "a file, where a folder is needed";
  fs::path kept;
  {
    const BlackBox box(*twin_, options_, log_);
    step_until([this] { return has_line("could not be copied and stay in"); });
    for (const fs::directory_entry& entry : fs::directory_iterator(options_.scratch)) {
      if (has_line("stay in " + entry.path().string() + ":")) kept = entry.path();
    }
    ASSERT_FALSE(kept.empty()) << testing::PrintToString(lines_);
  }
  EXPECT_TRUE(fs::exists(kept / (name_of_killed(0) + "_0.mcap")));
  fs::rename(kept, options_.scratch / name_of_killed(0));  // as if this process had ended, too
  fs::remove(options_.folder);
  const BlackBox box(*twin_, options_, log_);
  ASSERT_THAT(bags_after_steps(), SizeIs(1));
  EXPECT_EQ(messages(bags()[0], "/a"), 1U);
}

TEST_F(BlackBoxTest, FilesOfKilledProcessLeaveNamesOfBoxesFree) {
  leave_killed(0);
  std::ofstream(options_.folder) << "a file, where a folder is needed";
  const BlackBox box(*twin_, options_, log_);
  step_until([this] { return has_line("could not be copied and stay in"); });
  Twin second(scenario_of("omarm_zero"), log_, diagnostics_);
  const BlackBox other(second, options_, log_);
  const std::string name = rolling().filename().string() + "_2";
  EXPECT_TRUE(fs::exists(options_.scratch / name / (name + "_0.mcap")));
}

TEST_F(BlackBoxTest, TwoStartsCopyEachKilledProcessOnce) {
  constexpr int kKilled = 20;
  for (int i = 0; i < kKilled; ++i) leave_killed(i);
  options_.max_bags = 2 * kKilled;
  Twin second(scenario_of("omarm_zero"), log_, diagnostics_);
  {
    const BlackBox one(*twin_, options_, log_),
        other(second, options_, log_);  // the ends wait for the copies
  }
  EXPECT_THAT(bags(), SizeIs(kKilled));
  for (const fs::path& bag : bags()) EXPECT_EQ(messages(bag, "/a"), 1U) << bag;
  EXPECT_FALSE(has_line("could not be copied"));
  EXPECT_TRUE(fs::is_empty(options_.scratch));
}

TEST_F(BlackBoxTest, OldestBagsAreRemovedBeyondTheirNumber) {
  options_.max_bags = 3;
  for (const char* name : {"2020_a", "2021_b", "2022_c"}) fs::create_directories(options_.folder / name);
  const BlackBox box(*twin_, options_, log_);
  run_headless(*twin_, {.duration = from_seconds(0.2)});
  log_.error("arm", "something broke");
  step_until([this] { return !fs::exists(options_.folder / "2020_a"); });
  ASSERT_THAT(bags(), SizeIs(3));
  EXPECT_EQ(bags()[0].filename(), "2021_b");
}

}  // namespace
}  // namespace doppel
