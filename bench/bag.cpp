// Recording: what a recorder of 1 kHz and two cameras loses and costs the loop, what a kill costs; writing,
// info of 10 GB, seeking and recovering.
// build/bin/bench_bag [all | recorder | twin | kills | files] [seconds of recording] [MB of the file]
// [folder]
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>
#include <thread>

#include "doppel/base/mcap/mcap_recovery.h"
#include "doppel/lab/recording/run_recording.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/ros/record/bag_reader.h"
#include "doppel/ros/record/bag_writer.h"
#include "doppel/ros/record/bus_recorder.h"
#include "doppel/twin/assembly/twin.h"

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using doppel::Bytes;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

double seconds_of(const std::function<void()>& work) {
  const auto begin = Clock::now();
  work();
  return seconds_since(begin);
}

double percentile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1,
                         static_cast<std::size_t>(share * static_cast<double>(values.size())))];
}

double processor_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

doppel::sensor_msgs::msg::JointState joint_state() {
  doppel::sensor_msgs::msg::JointState out;
  for (int i = 0; i < 7; ++i) {
    out.name.push_back(fmt::format("joint_{}", i));
    out.position.push_back(0.1 * i);
    out.velocity.push_back(0);
    out.effort.push_back(0);
  }
  return out;
}

// 640 x 480, noisy as a camera's.
std::shared_ptr<const Bytes> picture(std::mt19937& random) {
  doppel::sensor_msgs::msg::Image out;
  out.width = 640;
  out.height = 480;
  out.encoding = "rgb8";
  out.step = 3 * out.width;
  out.data.resize(std::size_t{out.step} * out.height);
  for (std::size_t i = 0; i < out.data.size(); ++i)
    out.data[i] = static_cast<std::uint8_t>(i / 2000 + random() % 4);
  return std::make_shared<const Bytes>(doppel::to_cdr(out));
}

struct Loop {
  std::vector<double> steps;  // us
  double processor = 0;       // s
  doppel::RecorderReport report;
};

// A loop at 1 kHz that publishes a joint state in each step and two pictures at 30 Hz.
Loop run_loop(double duration, const fs::path& folder, bool record) {
  doppel::Bus bus;
  doppel::Node node(bus, "/robot");
  const auto joints = node.advertise<doppel::sensor_msgs::msg::JointState>("/joint_states");
  const auto left = node.advertise<doppel::sensor_msgs::msg::Image>("/left/image_raw");
  const auto right = node.advertise<doppel::sensor_msgs::msg::Image>("/right/image_raw");
  const doppel::Log log;
  std::optional<doppel::BusRecorder> recorder;
  if (record) {
    doppel::RecorderOptions options;
    options.bag.folder = folder;
    // An hour is 128 GB: the files are written, and the oldest ones are removed.
    constexpr double kMaxWhole = 900;
    if (duration > kMaxWhole) {
      options.bag.max_file_size = 1'000'000'000;
      options.keep = std::chrono::hours(24);
      options.keep_bytes = 8'000'000'000;
    }
    recorder.emplace(bus, std::move(options), log);
  }
  std::mt19937 random(1);
  std::vector<std::shared_ptr<const Bytes>> pictures;
  for (int i = 0; i < 8; ++i) pictures.push_back(picture(random));
  auto state = joint_state();
  Loop out;
  const double before = processor_seconds();
  const auto begin = Clock::now();
  const auto count = static_cast<std::int64_t>(duration * 1000);
  out.steps.reserve(static_cast<std::size_t>(count));
  for (std::int64_t step = 0; step < count; ++step) {
    std::this_thread::sleep_until(begin + std::chrono::milliseconds(step));
    const auto started = Clock::now();
    const doppel::Time now(std::chrono::milliseconds{step});
    bus.set_now(now);
    bus.spin();
    state.position[0] = 1e-3 * static_cast<double>(step);
    joints.publish(state, now);
    if (step % 33 == 0) {
      const auto number = static_cast<std::size_t>(step / 33);
      left.publish_encoded(pictures[number % 8], now);
      right.publish_encoded(pictures[(number + 3) % 8], now);
    }
    out.steps.push_back(std::chrono::duration<double, std::micro>(Clock::now() - started).count());
  }
  if (recorder) out.report = recorder->stop();
  out.processor = processor_seconds() - before;
  return out;
}

void bench_recorder(double duration, const fs::path& folder) {
  const Loop without = run_loop(std::min(duration, 20.0), folder, false);
  const Loop with = run_loop(duration, folder / "run", true);
  std::uint64_t lost = 0;
  for (const auto& [topic, messages] : with.report.lost) lost += messages;
  fmt::print("recorder, 1 kHz and two cameras, {:.0f} s: {} messages, {} lost, {:.1f} MB\n", duration,
             with.report.messages, lost, static_cast<double>(with.report.bytes) * 1e-6);
  fmt::print(
      "  a step publishes in us, p50 / p99 / p99.9: {:.1f} / {:.1f} / {:.1f} without, {:.1f} / {:.1f} / "
      "{:.1f} with\n",
      percentile(without.steps, 0.5), percentile(without.steps, 0.99), percentile(without.steps, 0.999),
      percentile(with.steps, 0.5), percentile(with.steps, 0.99), percentile(with.steps, 0.999));
  fmt::print("  processor: {:.1f} % of one core more\n",
             100 * (with.processor / duration - without.processor / std::min(duration, 20.0)));
}

class FileSink : public doppel::McapSink {
 public:
  explicit FileSink(const fs::path& file) : out_(file, std::ios::binary) {}
  void write(doppel::McapBytes bytes) override {
    out_.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }

 private:
  std::ofstream out_;
};

// A process that records is killed at a random time: what was published, and what the file has.
void bench_kills(int count, const fs::path& folder) {
  auto* const published = static_cast<std::atomic<std::int64_t>*>(
      mmap(nullptr, sizeof(std::int64_t), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
  std::mt19937 random(11);
  std::vector<double> lost;
  int unreadable = 0;
  for (int i = 0; i < count; ++i) {
    const fs::path bag = folder / fmt::format("killed_{}", i);
    *published = 0;
    const pid_t child = fork();
    if (child == 0) {
      doppel::Bus bus;
      doppel::Node node(bus, "/robot");
      const auto joints = node.advertise<doppel::sensor_msgs::msg::JointState>("/joint_states");
      const doppel::Log log;
      doppel::RecorderOptions options;
      options.bag.folder = bag;
      const doppel::BusRecorder recorder(bus, std::move(options), log);
      auto state = joint_state();
      const auto begin = Clock::now();
      for (std::int64_t step = 0;; ++step) {
        std::this_thread::sleep_until(begin + std::chrono::milliseconds(step));
        bus.spin();
        state.position[0] = static_cast<double>(step);
        joints.publish(state, doppel::Time(std::chrono::milliseconds{step}));
        *published = step + 1;
      }
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(100 + random() % 2000));
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    try {
      const doppel::BagReader reader(bag.string());
      lost.push_back(1e-3 *
                     static_cast<double>(*published - static_cast<std::int64_t>(reader.contents().messages)));
      FileSink sink(folder / "copy.mcap");
      const auto about =
          doppel::recover_mcap(*doppel::open_mcap_source(reader.contents().files[0]), sink, {});
      if (about.messages != reader.contents().messages) ++unreadable;
    } catch (const std::exception&) {
      ++unreadable;
    }
    fs::remove_all(bag);
  }
  fmt::print("{} kills at random times: {} not recoverable; s lost: median {:.2f}, most {:.2f}\n", count,
             unreadable, percentile(lost, 0.5), percentile(lost, 1));
}

// A twin at real time: the time of a step with everything that it publishes.
struct TwinRun {
  std::vector<double> steps;  // us
  double processor = 0;       // s
  std::uint64_t lost = 0;
};

enum class Listener { none, client, recorder };

// A client that reads everything and keeps nothing: what it costs that somebody listens.
class Reader {
 public:
  explicit Reader(doppel::Bus& bus) : edge_(bus.attach("/reader", {.ring_bytes = std::size_t{64} << 20})) {
    for (const doppel::TopicInfo& topic : bus.topics()) {
      if (!topic.publishers.empty()) edge_->subscribe(topic.id);
    }
    thread_ = std::thread([this] {
      doppel::Edge::Incoming message;
      while (!ending_) {
        while (edge_->next(message)) {
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
    });
  }
  ~Reader() {
    ending_ = true;
    thread_.join();
  }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

 private:
  std::unique_ptr<doppel::Edge> edge_;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

TwinRun run_twin(const std::string& robot, double duration, const fs::path& folder, Listener listener) {
  doppel::Scenario scenario;
  scenario.bundled_robots = DOPPEL_ROBOTS;
  scenario.robots = {{.target = robot}};
  const doppel::Log log;
  doppel::Diagnostics diagnostics;
  doppel::Twin twin(scenario, log, diagnostics);
  std::optional<doppel::BusRecorder> recorder;
  std::optional<Reader> reader;
  if (listener == Listener::client) reader.emplace(twin.bus());
  if (listener == Listener::recorder) {
    doppel::RunRecordingOptions options;
    options.bag.folder = folder;
    recorder.emplace(twin.bus(), run_recorder_options(twin, options, log), log);
  }
  TwinRun out;
  const double before = processor_seconds();
  const auto begin = Clock::now();
  for (auto due = begin; seconds_since(begin) < duration; due += twin.step_size()) {
    std::this_thread::sleep_until(due);
    const auto started = Clock::now();
    twin.between_steps();
    twin.step();
    out.steps.push_back(std::chrono::duration<double, std::micro>(Clock::now() - started).count());
  }
  if (recorder) {
    for (const auto& [topic, messages] : recorder->stop().lost) out.lost += messages;
  }
  out.processor = processor_seconds() - before;
  return out;
}

// In turn, so that all see the same machine.
void bench_twin(const std::string& robot, double duration, const fs::path& folder) {
  std::array<TwinRun, 3> sums;
  constexpr int kTurns = 4;
  for (int turn = 0; turn < kTurns; ++turn) {
    for (std::size_t i = 0; i < sums.size(); ++i) {
      const TwinRun run = run_twin(robot, duration / kTurns, folder / fmt::format("{}_{}", robot, turn),
                                   static_cast<Listener>(i));
      sums[i].steps.insert(sums[i].steps.end(), run.steps.begin(), run.steps.end());
      sums[i].processor += run.processor;
      sums[i].lost += run.lost;
    }
  }
  fmt::print(
      "twin of {}, {:.0f} s each; a step in us: nobody listens / a client reads everything / everything is "
      "recorded, {} lost\n",
      robot, duration, sums[2].lost);
  for (const double share : {0.5, 0.99, 0.999}) {
    std::array<double, 3> at_share{};
    for (std::size_t i = 0; i < sums.size(); ++i) at_share[i] = percentile(sums[i].steps, share);
    fmt::print("  p{:g}: {:.1f} / {:.1f} / {:.1f}; recorded to read {:+.1f} %\n", 100 * share, at_share[0],
               at_share[1], at_share[2], 100 * (at_share[2] / at_share[1] - 1));
  }
  fmt::print("  processor, of one core: {:.1f} / {:.1f} / {:.1f} %\n", 100 * sums[0].processor / duration,
             100 * sums[1].processor / duration, 100 * sums[2].processor / duration);
}

doppel::RecordedTopic joints_topic() {
  doppel::RecordedTopic out;
  out.name = "/joint_states";
  out.type = doppel::sensor_msgs::msg::JointState::kType;
  out.schema = doppel::find_type(out.type)->schema();
  return out;
}

// Bytes that do not compress, so that the file is as large as its messages.
std::string write_large(const fs::path& folder, std::uint64_t megabytes) {
  doppel::BagWriterOptions options;
  options.folder = folder;
  constexpr std::size_t kMessage = 4096;
  const std::uint64_t count = megabytes * 1'000'000 / kMessage;
  std::mt19937_64 random64(8);
  std::vector<std::byte> data(kMessage);
  double seconds = 0;
  {
    doppel::BagWriter writer(options);
    const std::size_t topic = writer.add_topic(joints_topic());
    seconds = seconds_of([&] {
      for (std::uint64_t i = 0; i < count; ++i) {
        for (std::size_t k = 0; k < kMessage; k += 8) {
          const std::uint64_t word = random64();
          std::memcpy(data.data() + k, &word, sizeof word);
        }
        writer.write(topic, static_cast<std::uint32_t>(i + 1), i * 1'000'000, i * 1'000'000, data);
      }
      writer.close();
    });
  }
  const std::string file = (folder / (folder.filename().string() + "_0.mcap")).string();
  fmt::print("write {} MB of messages: {:.2f} s, {:.0f} MB/s, file {:.0f} MB\n", megabytes, seconds,
             static_cast<double>(megabytes) / seconds, static_cast<double>(fs::file_size(file)) * 1e-6);
  return file;
}

void bench_seek(const std::string& file) {
  doppel::BagReader bag(file);
  std::mt19937_64 random(3);
  std::vector<double> times;
  for (int i = 0; i < 200; ++i) {
    const std::uint64_t time = random() % (bag.contents().end + 1);
    times.push_back(1e3 * seconds_of([&] {
                      bag.seek(time, UINT64_MAX, {});
                      if (!bag.next()) std::abort();
                    }));
  }
  fmt::print("seek and the next message, ms: p50 {:.2f}, p99 {:.2f}, most {:.2f}\n", percentile(times, 0.5),
             percentile(times, 0.99), percentile(times, 1));
}

// A file of 10 GB whose chunks are holes: only its summary is read.
void bench_info(const fs::path& folder) {
  constexpr std::uint64_t kChunk = 1U << 20U, kChunks = 10'000;
  const std::string file = (folder / "sparse.mcap").string();
  std::vector<std::byte> head(doppel::kMcapMagicSize), tail;
  std::memcpy(head.data(), doppel::kMcapMagic, doppel::kMcapMagicSize);
  doppel::append_record(doppel::McapHeader{"ros2", "bench_bag"}, head);
  const std::uint64_t data_end = head.size() + kChunk * kChunks;
  doppel::append_record(doppel::McapDataEnd{}, tail);
  const std::uint64_t summary = data_end + tail.size();
  const std::string schema = doppel::find_type("sensor_msgs/msg/JointState")->schema();
  doppel::append_record(
      doppel::McapSchema{1,
                         "sensor_msgs/msg/JointState",
                         "ros2msg",
                         {reinterpret_cast<const std::byte*>(schema.data()), schema.size()}},
      tail);
  doppel::append_record(doppel::McapChannel{1, 1, "/joint_states", "cdr", {}}, tail);
  doppel::McapStatistics statistics;
  statistics.message_count = kChunks * 1000;
  statistics.channel_count = statistics.schema_count = 1;
  statistics.chunk_count = kChunks;
  statistics.end_time = kChunks * 1'000'000'000;
  statistics.channel_message_counts = {{1, statistics.message_count}};
  doppel::append_record(statistics, tail);
  for (std::uint64_t i = 0; i < kChunks; ++i) {
    doppel::McapChunkIndex index;
    index.start_time = i * 1'000'000'000;
    index.end_time = index.start_time + 999'000'000;
    index.chunk_offset = head.size() + i * kChunk;
    index.chunk_length = kChunk;
    index.compression = "zstd";
    index.compressed_size = index.uncompressed_size = kChunk;
    doppel::append_record(index, tail);
  }
  doppel::append_record(doppel::McapFooter{summary, 0, 0}, tail);
  tail.insert(tail.end(), head.begin(), head.begin() + doppel::kMcapMagicSize);
  std::ofstream out(file, std::ios::binary);
  out.write(reinterpret_cast<const char*>(head.data()), static_cast<std::streamsize>(head.size()));
  out.seekp(static_cast<std::streamoff>(data_end));
  out.write(reinterpret_cast<const char*>(tail.data()), static_cast<std::streamsize>(tail.size()));
  out.close();
  std::vector<double> times;
  for (int i = 0; i < 11; ++i) {
    times.push_back(1e3 * seconds_of([&] {
                      const doppel::BagReader bag(file);
                      if (bag.contents().messages != statistics.message_count) std::abort();
                    }));
  }
  fmt::print("info of {:.1f} GB with {} chunks, ms: median {:.2f}, most {:.2f}\n",
             static_cast<double>(fs::file_size(file)) * 1e-9, kChunks, percentile(times, 0.5),
             percentile(times, 1));
}

void bench_recover(const std::string& file, const fs::path& folder) {
  fs::resize_file(file, fs::file_size(file) - 100);  // as a recorder that was killed leaves it
  doppel::McapRecovery about;
  const double seconds = seconds_of([&] {
    FileSink sink(folder / "recovered.mcap");
    about = doppel::recover_mcap(*doppel::open_mcap_source(file), sink, {});
  });
  fmt::print("recover {:.0f} MB: {:.2f} s, {} messages\n", static_cast<double>(fs::file_size(file)) * 1e-6,
             seconds, about.messages);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string part = argc > 1 ? argv[1] : "all";
  const double duration = argc > 2 ? std::atof(argv[2]) : 10;
  const auto megabytes = static_cast<std::uint64_t>(argc > 3 ? std::atol(argv[3]) : 1000);
  const fs::path folder =
      (argc > 4 ? fs::path(argv[4]) : fs::temp_directory_path()) / fmt::format("bench_bag_{}", getpid());
  fs::create_directories(folder);
  const bool all = part == "all";
  if (all || part == "recorder") bench_recorder(duration, folder);
  for (const char* robot : {"omarm_one", "lab_arm"}) {
    if (all || part == "twin") bench_twin(robot, duration, folder);
  }
  if (all || part == "kills") bench_kills(100, folder);
  if (all || part == "files") {
    const std::string file = write_large(folder / "large", megabytes);
    bench_seek(file);
    bench_info(folder);
    bench_recover(file, folder);
  }
  fs::remove_all(folder);
}
