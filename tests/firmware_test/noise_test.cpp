// Random lines, damaged lines, noise, silence, a stop pin and a weak supply: no pulse is ever outside of what
// was permitted.
#include <random>

#include "bench.h"

namespace doppel {
namespace {

class Talker {
 public:
  explicit Talker(std::uint64_t seed) : random_(seed) {}

  std::uint64_t below(std::uint64_t bound) { return random_() % bound; }
  std::string number(std::uint64_t low, std::uint64_t high) {
    return std::to_string(low + below(high - low + 1));
  }

  // A line of the host, mostly one that makes sense.
  std::string body() {
    switch (below(12)) {
      case 0:
        return "H 1 " + number(1, 9999);
      case 1:
        return "W " + number(10, 400) + (below(2) == 0 ? " hold" : " relax");
      case 2:
      case 3:
        return limits();
      case 4:
        return "E " + number(0, 17);
      case 5:
        return std::string(1, "SRQQQZ"[below(6)]);
      default:
        return targets();
    }
  }

  std::string damaged(std::string line) {
    const std::size_t place = below(line.size());
    switch (below(5)) {
      case 0:
        line[place] = static_cast<char>(line[place] ^ (1 << below(8)));
        break;
      case 1:
        line.erase(place, 1);
        break;
      case 2:
        line.insert(place, 1, static_cast<char>(below(256)));
        break;
      case 3:
        line.erase(place);
        break;
      default:
        line = noise() + line;
    }
    return line;
  }

  std::string noise() {
    std::string out(below(40), 0);
    for (char& byte : out) byte = static_cast<char>(below(256));
    return out;
  }

 private:
  std::string limits() {
    const std::uint64_t min = 250 + below(1500);
    return "C " + number(0, 4) + " " + std::to_string(min) + " " + number(min, min + 1500) + " " +
           number(1, 8000) + " " + number(1, 60000);
  }
  std::string targets() {
    std::string out = "P " + std::to_string(++sequence_);
    for (std::uint64_t i = below(4) + 1; i > 0; --i) out += below(4) == 0 ? " -" : " " + number(1, 3500);
    return out;
  }

  std::mt19937_64 random_;
  std::uint32_t sequence_ = 0;
};

class ServoNoise : public testing::TestWithParam<std::uint64_t> {};

TEST_P(ServoNoise, NoPulseLeavesWhatIsPermitted) {
  const std::uint64_t seed = GetParam();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  Talker talker(seed);
  WatchedBoard board;
  board.supply = 5000;
  doppel_servo::Config config;
  config.channels = 4;
  doppel_servo::Firmware firmware(board, config);
  std::size_t ramps = 0;
  for (int turn = 0; turn < 60000 && board.violation.empty(); ++turn) {
    if (talker.below(8) == 0) {
      const std::string body = talker.body();
      board.ask(body);
      FrameBytes line;
      add_servo_line(body, line);
      std::string bytes(reinterpret_cast<const char*>(line.bytes().data()), line.size());
      if (talker.below(6) == 0) bytes = talker.damaged(bytes);
      for (const char byte : bytes) firmware.receive(static_cast<std::uint8_t>(byte));
    }
    if (talker.below(3000) == 0) board.stop = !board.stop;
    if (talker.below(5000) == 0)
      board.supply = board.supply == 5000 ? static_cast<std::int32_t>(talker.below(5000)) : 5000;
    const auto elapsed = static_cast<std::uint32_t>(talker.below(20) == 0 ? talker.below(40) : 1);
    board.now += elapsed;
    firmware.tick();
    board.check_motion(elapsed);
    ramps += (firmware.flags() & doppel_servo::kRamping) != 0 ? 1 : 0;
    board.sent.clear();
    board.lines.clear();
  }
  EXPECT_EQ(board.violation, "");
  EXPECT_GT(board.pulses, 1000U);  // or the test has seen nothing
  EXPECT_GT(ramps, 1000U);
  EXPECT_GT(firmware.dropped_lines(), 100U);
}

INSTANTIATE_TEST_SUITE_P(Seeds, ServoNoise, testing::Range<std::uint64_t>(1, 21));

}  // namespace
}  // namespace doppel
