// The end of a recording while clients wait for copies of its last messages.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <future>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "doppel/ros/record/bus_recorder.h"

namespace doppel {
namespace {

using testing::ElementsAre;
using namespace std::chrono_literals;

// No copy has a bag: its client is answered with what making one has thrown.
TEST(RecorderEnd, OneOfCopiesThatClientsWaitForIsMade) {
  Log log;
  Bus bus;
  RecorderOptions options;
  options.bag.folder = std::filesystem::path(testing::TempDir()) / "recorder_end";
  std::filesystem::remove_all(options.bag.folder);
  BusRecorder recorder(bus, options, log);
  std::promise<void> reached, opened;
  BusRecorder::Copy held;
  held.make_bag = [&]() -> std::unique_ptr<BagWriter> {
    reached.set_value();
    opened.get_future().wait();
    throw std::runtime_error("held");
  };
  recorder.copy(std::move(held));
  reached.get_future().wait();
  std::vector<std::string> reasons;
  for (int i = 0; i < 3; ++i) {
    BusRecorder::Copy copy;
    copy.make_bag = []() -> std::unique_ptr<BagWriter> { throw std::runtime_error("begun"); };
    copy.done = [&reasons](const std::string& reason) { reasons.push_back(reason); };
    recorder.copy(std::move(copy));
  }
  std::thread opening([&opened] {
    std::this_thread::sleep_for(200ms);  // the end has begun
    opened.set_value();
  });
  recorder.stop();
  opening.join();
  std::filesystem::remove_all(options.bag.folder);
  EXPECT_THAT(reasons, ElementsAre("begun", "the recording has ended", "the recording has ended"));
}

}  // namespace
}  // namespace doppel
