// The recorder of a bus: what it takes, what it has lost, and what it leaves behind when the disk is full.
#include "doppel/ros/record/bus_recorder.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <future>
#include <memory>
#include <new>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>

#include "doppel/base/mcap/mcap_memory_sink.h"
#include "doppel/ros/messages/rosbag2_interfaces.h"
#include "doppel/ros/messages/std_msgs.h"
#include "doppel/ros/record/bag_copy.h"
#include "doppel/ros/record/bag_player.h"
#include "doppel/ros/record/bag_reader.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using std_msgs::msg::String;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;
using namespace std::chrono_literals;

class BusRecorderTest : public testing::Test {
 protected:
  BusRecorderTest() {
    fs::remove_all(folder_);
    log_.add_sink([this](const LogLine& line) { lines_.push_back(line.text); });
  }
  ~BusRecorderTest() override { fs::remove_all(folder_); }

  RecorderOptions options() const {
    RecorderOptions out;
    out.bag.folder = folder_;
    return out;
  }
  std::vector<std::string> read() const { return read(folder_); }
  static std::vector<std::string> read(const fs::path& bag) {
    BagReader reader(bag.string());
    std::vector<std::string> out;
    while (const auto message = reader.next()) {
      String value;
      EXPECT_TRUE(from_cdr(message->data, value));
      out.push_back(reader.contents().topics[message->topic].name + "=" + value.data);
    }
    return out;
  }

  // The recorder makes and removes files meanwhile.
  std::vector<std::uintmax_t> sizes_in_folder() const {
    std::vector<std::uintmax_t> out;
    std::error_code none;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_, none)) {
      const std::uintmax_t size = fs::file_size(entry.path(), none);
      if (!none && entry.path().extension() == ".mcap") out.push_back(size);
    }
    return out;
  }
  std::size_t files_in_folder() const { return sizes_in_folder().size(); }
  std::uint64_t bytes_in_folder() const {
    const std::vector<std::uintmax_t> sizes = sizes_in_folder();
    return std::accumulate(sizes.begin(), sizes.end(), std::uint64_t{0});
  }

  // Two nodes have a latched message each on one topic, and the second of them joins later.
  void record_joining_publisher(RecorderOptions chosen) {
    chosen.on_loop = true;
    const auto first = node_.advertise<String>("/latched", {.depth = 1, .latched = true});
    const auto a = node_.advertise<String>("/a");
    first.publish({"first"}, time_from_seconds(1));
    BusRecorder recorder(bus_, std::move(chosen), log_);
    recorder.take();
    Node joining(bus_, "/joining");
    const auto second = joining.advertise<String>("/latched", {.depth = 1, .latched = true});
    second.publish({"second"}, time_from_seconds(2));
    a.publish({"x"}, time_from_seconds(10));
    recorder.stop();
  }
  // Holds a function of a copy until the test has done its part.
  struct Checkpoint {
    void pass() {
      reached.set_value();
      open.get_future().wait();
    }
    std::promise<void> reached, open;
  };
  // A copy of the last ten seconds to a folder below that of the recording.
  BusRecorder::Copy copy_to(const std::string& name, std::function<void()> begin) const {
    BusRecorder::Copy out;
    out.last = from_seconds(10);
    out.make_bag = [folder = folder_ / name, begin = std::move(begin)] {
      begin();
      BagWriterOptions bag;
      bag.folder = folder;
      return std::make_unique<BagWriter>(bag);
    };
    return out;
  }

  const fs::path folder_ =
      fs::path(testing::TempDir()) /
      (std::string("recorder_") + testing::UnitTest::GetInstance()->current_test_info()->name());
  Log log_;
  std::vector<std::string> lines_;
  Bus bus_;
  Node node_{bus_, "/n"};
};

TEST_F(BusRecorderTest, LaterTopicsAreRecordedAndLatchedOnesWithLastMessage) {
  const auto old = node_.advertise<String>("/old", {.latched = true});
  old.publish({"before"}, time_from_seconds(1));
  BusRecorder recorder(bus_, options(), log_);
  bus_.spin();
  const auto late = node_.advertise<String>("/late", {.latched = true});
  late.publish({"after"}, time_from_seconds(2));
  for (int i = 0; i < 200 && recorder.messages() < 2; ++i) {
    bus_.spin();
    std::this_thread::sleep_for(5ms);
  }
  EXPECT_THAT(recorder.stop().lost, IsEmpty());
  EXPECT_THAT(read(), ElementsAre("/old=before", "/late=after"));
  EXPECT_THAT(lines_, IsEmpty());
}

TEST_F(BusRecorderTest, SameStepsOnLoopGiveSameBytesInMemory) {
  std::vector<std::vector<std::byte>> files;
  for (int run = 0; run < 2; ++run) {
    Bus bus;
    Node node(bus, "/n");
    const auto latched = node.advertise<String>("/latched", {.latched = true});
    const auto topic = node.advertise<String>("/topic");
    latched.publish({"before"}, time_from_seconds(1));
    bus.set_now(time_from_seconds(5));
    McapMemorySink sink;
    RecorderOptions in_memory = options();
    in_memory.bag.sink = &sink;
    in_memory.listed = false;
    in_memory.on_loop = true;
    BusRecorder recorder(bus, std::move(in_memory), log_);
    for (int i = 0; i < 3; ++i) {
      bus.spin();
      bus.set_now(time_from_seconds(5 + i));
      topic.publish({std::to_string(i)}, bus.now());
      if (run == 1) std::this_thread::sleep_for(10ms);
      recorder.take();
    }
    recorder.stop();
    EXPECT_FALSE(fs::exists(folder_));
    files.push_back(sink.take());
  }
  EXPECT_TRUE(files[0] == files[1]);
  fs::create_directory(folder_);
  const fs::path file = folder_ / "a.mcap";
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(files[0].data()), static_cast<std::streamsize>(files[0].size()));
  EXPECT_THAT(read(), ElementsAre("/latched=before", "/topic=0", "/topic=1", "/topic=2"));
  // Latched messages of former times come at the begin of the recording.
  EXPECT_EQ(BagReader(file.string()).contents().start, 5'000'000'000U);
}

TEST_F(BusRecorderTest, LossesAreCountedByTopicAndReported) {
  RecorderOptions small = options();
  small.ring_bytes = 4096;
  const auto many = node_.advertise<String>("/many");
  BusRecorder recorder(bus_, small, log_);
  bus_.spin();
  // The reader of the ring cannot be faster than this loop, which fills it many times.
  constexpr std::uint64_t kCount = 20'000;
  for (std::uint64_t i = 0; i < kCount; ++i) many.publish({std::string(500, 'x')}, Time(Duration(i)));
  std::this_thread::sleep_for(100ms);
  many.publish({"last"}, Time(Duration(kCount)));
  const RecorderReport& report = recorder.stop();
  ASSERT_THAT(report.lost, testing::Contains(testing::Key("/many")));
  EXPECT_EQ(report.messages + report.lost.at("/many"), kCount + 1);
  EXPECT_THAT(lines_, ElementsAre(HasSubstr("were lost")));
  BagReader reader(folder_.string());
  const auto& parts = reader.contents().metadata;
  const auto lost =
      std::ranges::find_if(parts, [](const BagPart& part) { return part.part.name == "lost_messages"; });
  ASSERT_NE(lost, parts.end());
  EXPECT_THAT(reader.metadata(*lost), ElementsAre(Pair("/many", std::to_string(report.lost.at("/many")))));
}

// The limit of a file's size stands in for a disk that is full: the system refuses to write beyond it.
TEST_F(BusRecorderTest, FullDiskEndsRecordingWithItsReasonAndLeavesReadableFile) {
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  RecorderOptions raw = options();
  raw.bag.file.compression = "";
  raw.bag.file.chunk_size = 10'000;
  const auto topic = node_.advertise<String>("/a");
  BusRecorder recorder(bus_, raw, log_);
  bus_.spin();
  const rlimit small{300'000, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  for (int i = 0; i < 1000; ++i) topic.publish({std::string(1000, 'x')}, Time(Duration(i)));
  const std::string failure = recorder.stop().failure;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  EXPECT_THAT(failure, HasSubstr("cannot be written"));
  EXPECT_THAT(lines_, testing::Contains(HasSubstr("the recording has ended")));
  fs::remove(folder_ / "metadata.yaml");
  BagReader reader(folder_.string());
  EXPECT_GT(reader.contents().messages, 200U);
  EXPECT_EQ(recorder.stop().messages, reader.contents().messages);
  EXPECT_THAT(reader.contents().notes, ElementsAre(HasSubstr("was not closed")));
}

TEST_F(BusRecorderTest, RequestsAfterFailureAreRefusedWithItsReason) {
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  RecorderOptions raw = options();
  raw.bag.file.compression = "";
  std::promise<std::string> failed;
  raw.on_failure = [&](const std::string& why) { failed.set_value(why); };
  const auto topic = node_.advertise<String>("/a");
  BusRecorder recorder(bus_, raw, log_);
  bus_.spin();
  const rlimit small{10'000, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  topic.publish({std::string(20'000, 'x')}, Time(Duration(1)));
  const std::string why = failed.get_future().get();
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  EXPECT_THAT(why, HasSubstr("cannot be written"));
  // The thread refuses what waits right behind its report, or copy() does.
  std::promise<std::string> answer;
  BusRecorder::Copy copy;
  copy.done = [&](const std::string& reason) { answer.set_value(reason); };
  recorder.copy(std::move(copy));
  EXPECT_EQ(answer.get_future().get(), why);
  std::promise<bool> acted;
  recorder.act(RecorderAction::pause, [&](bool fine) { acted.set_value(fine); });
  EXPECT_FALSE(acted.get_future().get());
  EXPECT_THAT(lines_, IsEmpty());
}

TEST_F(BusRecorderTest, RequestsBeyondTheirNumberAreRefused) {
  RecorderOptions loop = options();
  loop.on_loop = true;  // nothing serves them
  std::vector<std::string> reasons;
  std::vector<bool> actions;
  BusRecorder recorder(bus_, loop, log_);
  for (std::size_t i = 0; i <= BusRecorder::kMaxRequests; ++i) {
    BusRecorder::Copy copy;
    copy.done = [&](const std::string& reason) { reasons.push_back(reason); };
    recorder.copy(std::move(copy));
    recorder.act(RecorderAction::split, [&](bool done) { actions.push_back(done); });
  }
  EXPECT_THAT(reasons, ElementsAre(HasSubstr("32 requests wait already")));
  EXPECT_THAT(actions, ElementsAre(false));
}

TEST_F(BusRecorderTest, MessagesAreTakenBetweenTwoCopies) {
  const auto topic = node_.advertise<String>("/a");
  BusRecorder recorder(bus_, options(), log_);
  bus_.spin();
  Checkpoint first, second;
  std::promise<std::string> done;
  recorder.copy(copy_to("first", [&] { first.pass(); }));
  first.reached.get_future().wait();
  // Both of these wait at the same time.
  recorder.copy(copy_to("second", [&] { second.pass(); }));
  BusRecorder::Copy third = copy_to("third", [] {});
  third.done = [&](const std::string& failure) { done.set_value(failure); };
  recorder.copy(std::move(third));
  first.open.set_value();
  second.reached.get_future().wait();
  topic.publish({"x"}, time_from_seconds(1));
  second.open.set_value();
  EXPECT_EQ(done.get_future().get(), "");
  recorder.stop();
  EXPECT_THAT(read(folder_ / "third"), ElementsAre("/a=x"));
}

TEST_F(BusRecorderTest, CopyThatThrowsIsAnsweredAndRecordingGoesOn) {
  const auto topic = node_.advertise<String>("/a");
  BusRecorder recorder(bus_, options(), log_);
  bus_.spin();
  topic.publish({"x"}, time_from_seconds(1));
  // A copy that is let go of without an answer breaks the promise.
  const auto answer_to = [&recorder](BusRecorder::Copy copy) {
    auto done = std::make_shared<std::promise<std::string>>();
    std::future<std::string> answer = done->get_future();
    copy.done = [done = std::move(done)](const std::string& failure) { done->set_value(failure); };
    recorder.copy(std::move(copy));
    return answer.get();
  };
  EXPECT_EQ(answer_to(copy_to("throws", [] { throw std::runtime_error("no room"); })), "no room");
  EXPECT_THAT(answer_to(copy_to("throws a number", [] { throw 42; })),  // NOLINT: no std::exception
              HasSubstr("other than a std::exception"));
  BusRecorder::Copy begun = copy_to("begun", [] {});
  begun.add_parts = [](BagWriter&, std::uint64_t) { throw std::bad_alloc(); };
  EXPECT_THAT(answer_to(begun), HasSubstr("not enough memory"));
  EXPECT_FALSE(fs::exists(folder_ / "begun"));
  EXPECT_EQ(answer_to(copy_to("whole", [] {})), "");
  EXPECT_EQ(recorder.stop().failure, "");
  EXPECT_THAT(read(folder_ / "whole"), ElementsAre("/a=x"));
}

TEST_F(BusRecorderTest, UrgentCopyIsMadeBeforeRequestsThatFillQueue) {
  BusRecorder recorder(bus_, options(), log_);
  Checkpoint held;
  std::vector<std::string> order;
  const auto request = [&](const std::string& name) {
    BusRecorder::Copy out = copy_to(name, [] { throw std::runtime_error("no bag is needed"); });
    out.done = [&order, name](const std::string&) { order.push_back(name); };
    return out;
  };
  recorder.copy(copy_to("held", [&] { held.pass(); }));
  held.reached.get_future().wait();
  for (std::size_t i = 0; i < BusRecorder::kMaxRequests; ++i) recorder.copy(request("of a client"));
  for (const char* const name : {"urgent", "as urgent"}) {
    BusRecorder::Copy urgent = request(name);
    urgent.is_urgent = true;
    recorder.copy(std::move(urgent));
  }
  EXPECT_THAT(order, IsEmpty()) << "expected no refusal";
  held.open.set_value();
  recorder.stop();
  ASSERT_THAT(order, testing::SizeIs(BusRecorder::kMaxRequests + 2));
  EXPECT_EQ(order[0], "urgent");
  EXPECT_EQ(order[1], "as urgent");
}

TEST_F(BusRecorderTest, NextFileRepeatsLatchedMessageOfPublisherThatJoinedLater) {
  RecorderOptions split = options();
  split.bag.max_file_time = from_seconds(5);
  record_joining_publisher(split);
  const std::vector<std::string> files = files_of_bag(folder_.string());
  ASSERT_THAT(files, testing::SizeIs(2));
  EXPECT_THAT(read(files[1]), ElementsAre("/latched=first", "/latched=second", "/a=x"));
}

TEST_F(BusRecorderTest, PartBeginsWithLatchedMessageOfPublisherThatJoinedLater) {
  record_joining_publisher(options());
  BagReader whole(folder_.string());
  BagWriterOptions part;
  part.folder = folder_ / "part";
  BagWriter copy(part);
  copy_from(whole, 5'000'000'000, UINT64_MAX, {}, copy);
  copy.close();
  EXPECT_THAT(read(part.folder), ElementsAre("/latched=first", "/latched=second", "/a=x"));
}

TEST_F(BusRecorderTest, FilesAreKeptBySpanAlsoWhereTimeIsSetBack) {
  RecorderOptions rolling = options();
  rolling.keep = from_seconds(2);
  rolling.keep_bytes = std::uint64_t{10} << 20U;
  rolling.bag.max_file_time = from_seconds(1);
  const auto topic = node_.advertise<String>("/a");
  BusRecorder recorder(bus_, rolling, log_);
  bus_.spin();
  for (int run = 0; run < 30; ++run) {
    for (int i = 0; i <= 20; ++i) topic.publish({"x"}, time_from_seconds(0.01 * i));
  }
  const auto is_there = [this](int file) {
    return fs::exists(folder_ / fmt::format("{}_{}.mcap", folder_.filename().string(), file));
  };
  for (int i = 0; i < 3000 && (recorder.messages() < 30 * 21 || is_there(19)); ++i)
    std::this_thread::sleep_for(10ms);
  EXPECT_THAT(recorder.stop().lost, IsEmpty());
  const std::size_t files = BagReader(folder_.string()).contents().files.size();
  EXPECT_GE(files, 10U) << "each has 0.2 s";
  EXPECT_LE(files, 12U);
}

TEST_F(BusRecorderTest, OldestFilesAreRemovedBeyondTheirBytes) {
  constexpr std::uint64_t kMessages = 100, kMessage = 10'000;
  RecorderOptions rolling = options();
  rolling.keep = from_seconds(1e6);  // The span removes none.
  rolling.keep_bytes = 20 * kMessage;
  rolling.bag.max_file_size = 5 * kMessage;
  rolling.bag.file.compression = "";
  const auto topic = node_.advertise<String>("/a");
  BusRecorder recorder(bus_, rolling, log_);
  bus_.spin();
  for (std::uint64_t i = 0; i < kMessages; ++i)
    topic.publish({std::string(kMessage, 'x')}, time_from_seconds(static_cast<double>(i)));
  const auto is_bounded = [&] {
    return recorder.messages() == kMessages && bytes_in_folder() <= rolling.keep_bytes;
  };
  for (int i = 0; i < 2000 && !is_bounded(); ++i) std::this_thread::sleep_for(10ms);
  EXPECT_TRUE(is_bounded()) << bytes_in_folder() << " bytes of " << recorder.messages() << " messages";
  EXPECT_THAT(recorder.stop().lost, IsEmpty());
  const BagReader bag(folder_.string());
  EXPECT_LE(bytes_in_folder(), rolling.keep_bytes + rolling.bag.max_file_size);
  EXPECT_GE(bytes_in_folder(), rolling.keep_bytes / 2) << "what fits is kept";
  EXPECT_EQ(bag.contents().end, (kMessages - 1) * 1'000'000'000U) << "the newest are kept";
}

TEST_F(BusRecorderTest, OldestFilesAreRemovedBeyondTheirNumber) {
  constexpr std::size_t kMessages = kMaxKeptFiles + 30;
  RecorderOptions rolling = options();
  rolling.keep = from_seconds(1e6);  // The span removes none.
  rolling.keep_bytes = std::uint64_t{1} << 30U;
  rolling.bag.max_file_time = from_seconds(0.5);  // Each message has a file.
  const auto topic = node_.advertise<String>("/a");
  BusRecorder recorder(bus_, rolling, log_);
  bus_.spin();
  for (std::size_t i = 0; i < kMessages; ++i)
    topic.publish({std::to_string(i)}, time_from_seconds(static_cast<double>(i)));
  const auto is_bounded = [&] {
    return recorder.messages() == kMessages && files_in_folder() <= kMaxKeptFiles;
  };
  for (int i = 0; i < 2000 && !is_bounded(); ++i) std::this_thread::sleep_for(10ms);
  EXPECT_THAT(recorder.stop().lost, IsEmpty());
  EXPECT_EQ(files_in_folder(), kMaxKeptFiles);
  const std::vector<std::string> kept = read();
  ASSERT_EQ(kept.size(), kMaxKeptFiles);
  EXPECT_EQ(kept.front(), "/a=30");
  EXPECT_EQ(kept.back(), fmt::format("/a={}", kMessages - 1));
}

TEST_F(BusRecorderTest, SelectionByRegexAndTypesIsThatOfRosbag2) {
  const TopicSelection all{.all = true, .exclude_topics = {"/b"}, .exclude_regex = "image"};
  EXPECT_TRUE(all.selects("/a", "t"));
  EXPECT_TRUE(all.selects("/arm/save/_service_event", "t"));
  EXPECT_TRUE(all.selects("/arm/follow/_action/feedback", "t"));
  EXPECT_FALSE(all.selects("/b", "t"));
  EXPECT_FALSE(all.selects("/cam/image_raw", "t"));
  EXPECT_FALSE(all.selects("/_hidden", "t"));
  const TopicSelection services{.services = {"/arm/save"}};
  EXPECT_TRUE(services.selects("/arm/save/_service_event", "t"));
  EXPECT_FALSE(services.selects("/arm/save", "t"));
  const TopicSelection actions{.actions = {"/arm/follow"}};
  EXPECT_TRUE(actions.selects("/arm/follow/_action/send_goal/_service_event", "t"));
  EXPECT_FALSE(actions.selects("/arm/follower/_action/status", "t"));
  const TopicSelection by_type{.types = {"t"}, .regex = "^/x"};
  EXPECT_TRUE(by_type.selects("/a", "t"));
  EXPECT_TRUE(by_type.selects("/xy", "u"));
  EXPECT_FALSE(by_type.selects("/a", "u"));
}

TEST_F(BusRecorderTest, PlayerPublishesWhatWasRecordedInPaceAndByLatchedState) {
  {
    const auto latched = node_.advertise<String>("/latched", {.latched = true});
    const auto a = node_.advertise<String>("/a");
    latched.publish({"arm"}, time_from_seconds(0));
    BusRecorder recorder(bus_, options(), log_);
    bus_.spin();
    for (int i = 1; i <= 4; ++i) a.publish({std::to_string(i)}, time_from_seconds(i));
    EXPECT_EQ(recorder.stop().messages, 5U);
  }
  Bus other;
  BagReader bag(folder_.string());
  BagPlayer player(other, bag, {.rate = 2}, log_);
  Node listener(other, "/listener");
  std::vector<std::string> got;
  listener.subscribe<String>("/a", [&](const String& message) { got.push_back(message.data); });
  const auto begin = BagPlayer::Clock::now();
  player.seek(0, begin);
  player.play(begin + 400ms);
  EXPECT_THAT(got, IsEmpty());
  player.play(begin + 1010ms);
  EXPECT_THAT(got, ElementsAre("1", "2"));
  player.seek(3'500'000'000, begin + 1010ms);
  EXPECT_THAT(got, ElementsAre("1", "2", "3"));  // its state at that time
  player.play(begin + 1300ms);
  EXPECT_THAT(got, ElementsAre("1", "2", "3", "4"));
  EXPECT_TRUE(player.at_end());
  const auto late = other.attach("late");
  for (const TopicInfo& topic : other.topics()) late->subscribe(topic.id);
  other.spin();
  Edge::Incoming message;
  ASSERT_TRUE(late->next(message));
  String value;
  ASSERT_TRUE(from_cdr(message.cdr, value));
  EXPECT_EQ(value.data, "arm");
}

TEST_F(BusRecorderTest, PlayerMakesTypesThatThisProgramDoesNotKnow) {
  {
    BagWriter writer(options().bag);
    RecordedTopic foreign;
    foreign.name = "/foreign";
    foreign.type = "doppel_msgs/msg/PointOfAnotherVersion";
    foreign.schema = "float64 x\nfloat64 y\n";
    const std::size_t topic = writer.add_topic(foreign);
    RecordedTopic broken = foreign;
    broken.name = "/broken";
    broken.type = "doppel_msgs/msg/BrokenOfAnotherVersion";
    broken.schema = "Nothing a\n";
    writer.write(writer.add_topic(broken), 1, 1, 1, Bytes(20));
    writer.write(topic, 1, 1, 1,
                 Bytes{std::byte{0},    std::byte{1},    std::byte{0}, std::byte{0}, std::byte{0},
                       std::byte{0},    std::byte{0},    std::byte{0}, std::byte{0}, std::byte{0},
                       std::byte{0xf0}, std::byte{0x3f}, std::byte{0}, std::byte{0}, std::byte{0},
                       std::byte{0},    std::byte{0},    std::byte{0}, std::byte{0}, std::byte{0}});
    writer.close();
  }
  BagReader bag(folder_.string());
  BagPlayer player(bus_, bag, {}, log_);
  const auto edge = bus_.attach("reader");
  bus_.spin();
  for (const TopicInfo& topic : bus_.topics()) edge->subscribe(topic.id);
  bus_.spin();
  player.play(BagPlayer::Clock::now() + 1s);
  Edge::Incoming message;
  ASSERT_TRUE(edge->next(message));
  std::string yaml;
  ASSERT_TRUE(find_type("doppel_msgs/msg/PointOfAnotherVersion")->cdr_to_yaml(message.cdr, yaml));
  EXPECT_THAT(yaml, HasSubstr("x: 1.0"));
  EXPECT_THAT(player.skipped(), ElementsAre("/broken"));
  EXPECT_THAT(lines_, ElementsAre(HasSubstr("/broken is not played")));
}

class RecorderServicesTest : public BusRecorderTest {
 protected:
  template <Service S>
  bool call(const std::string& name, typename S::Response* response = nullptr) {
    std::optional<bool> out;
    client_->call("/rosbag2_recorder/" + name, to_cdr(typename S::Request{}),
                  [&](const Status& status, const Bytes& cdr) {
                    typename S::Response value;
                    out = status.ok() && from_cdr(cdr, value);
                    if (response != nullptr) *response = value;
                  });
    for (int i = 0; i < 400 && !out; ++i) {
      bus_.spin();
      std::this_thread::sleep_for(5ms);
    }
    EXPECT_TRUE(out.has_value()) << name;
    return out.value_or(false);
  }
  bool is_paused() {
    rosbag2_interfaces::srv::IsPaused::Response out;
    EXPECT_TRUE(call<rosbag2_interfaces::srv::IsPaused>("is_paused", &out));
    return out.paused;
  }

  std::unique_ptr<Edge> client_ = bus_.attach("client");
};

TEST_F(RecorderServicesTest, PauseLeavesMessagesOutButJournalAndLatchedOnes) {
  const auto a = node_.advertise<String>("/a"), journal = node_.advertise<String>("/journal");
  const auto latched = node_.advertise<String>("/latched", {.latched = true});
  RecorderOptions chosen = options();
  chosen.unpaused = {"/journal"};
  BusRecorder recorder(bus_, chosen, log_);
  a.publish({"1"}, time_from_seconds(1));
  EXPECT_TRUE(call<rosbag2_interfaces::srv::Pause>("pause"));
  EXPECT_TRUE(is_paused());
  a.publish({"2"}, time_from_seconds(2));
  latched.publish({"old"}, time_from_seconds(2));
  latched.publish({"new"}, time_from_seconds(2));
  journal.publish({"x"}, time_from_seconds(3));
  EXPECT_TRUE(call<rosbag2_interfaces::srv::TogglePaused>("toggle_paused"));
  EXPECT_FALSE(is_paused());
  a.publish({"3"}, time_from_seconds(4));
  EXPECT_THAT(recorder.stop().lost, IsEmpty());
  EXPECT_THAT(read(), ElementsAre("/a=1", "/journal=x", "/latched=new", "/a=3"));
}

TEST_F(RecorderServicesTest, SplitBeginsNewFileAndStopCompletesBag) {
  const auto a = node_.advertise<String>("/a");
  BusRecorder recorder(bus_, options(), log_);
  a.publish({"1"}, time_from_seconds(1));
  EXPECT_TRUE(call<rosbag2_interfaces::srv::SplitBagfile>("split_bagfile"));
  a.publish({"2"}, time_from_seconds(2));
  EXPECT_TRUE(call<rosbag2_interfaces::srv::Stop>("stop"));
  EXPECT_TRUE(fs::exists(folder_ / "metadata.yaml"));
  a.publish({"3"}, time_from_seconds(3));
  EXPECT_FALSE(call<rosbag2_interfaces::srv::Pause>("pause")) << "expected a refusal after the end";
  EXPECT_EQ(recorder.stop().messages, 2U);
  EXPECT_THAT(read(), ElementsAre("/a=1", "/a=2"));
  EXPECT_EQ(BagReader(folder_.string()).contents().files.size(), 2U);
}

}  // namespace
}  // namespace doppel
