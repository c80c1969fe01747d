// Fuzz target: bytes for the firmware of examples/firmware/doppel_servo. A line that begins with '+' is time,
// one that begins with '~' is sent as it is, and every other one gets its check. No pulse is ever outside of
// what was permitted.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include "../../../../../tests/firmware_test/watched_board.h"
#include "doppel/devices/frames/servo_line.h"

namespace {

constexpr int kMaxTicks = 3000;

class Run {
 public:
  Run() : firmware_(board_, config()) {}

  void line(std::string_view text) {
    if (text.starts_with('+')) return pass(text.substr(1));
    if (text.starts_with('~')) {
      send(text.substr(1));
      return send("\n");
    }
    board_.ask(text);
    if (text.size() + 7 > doppel::kServoLineMax) return send(std::string(text) + "\n");
    doppel::FrameBytes bytes;
    doppel::add_servo_line(text, bytes);
    send({reinterpret_cast<const char*>(bytes.bytes().data()), bytes.size()});
  }

 private:
  static doppel_servo::Config config() {
    doppel_servo::Config out;
    out.channels = 3;
    out.inputs = 2;
    return out;
  }
  void send(std::string_view bytes) {
    for (const char byte : bytes) firmware_.receive(static_cast<std::uint8_t>(byte));
    check();
  }
  // "+", then a letter for the stop pin and the supply, then as many ms as bytes.
  void pass(std::string_view text) {
    if (text.empty()) return;
    board_.stop = text[0] == 's';
    board_.supply = text[0] == 'l' ? 4000 : text[0] == 'd' ? 10 : 5000;
    for (const char byte : text.substr(1)) {
      const int count = static_cast<std::uint8_t>(byte);
      for (int i = 0; i < count && ticks_ < kMaxTicks; ++i, ++ticks_) {
        ++board_.now;
        firmware_.tick();
        board_.check_motion(1);
      }
    }
    check();
  }
  void check() {
    for (const std::string& sent : board_.lines) {
      if (std::holds_alternative<std::monostate>(doppel::parse_servo_reply(sent))) fail("no reply: " + sent);
    }
    board_.lines.clear();
    board_.sent.clear();
    if (!board_.violation.empty()) fail(board_.violation);
  }
  [[noreturn]] static void fail(const std::string& text) {
    std::fprintf(stderr, "%s\n", text.c_str());
    std::abort();
  }

  doppel::WatchedBoard board_;
  doppel_servo::Firmware firmware_;
  int ticks_ = 0;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Run run;
  std::string_view rest(reinterpret_cast<const char*>(data), size);
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    run.line(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return 0;
}
