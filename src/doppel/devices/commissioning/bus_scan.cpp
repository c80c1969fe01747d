#include "doppel/devices/commissioning/bus_scan.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "doppel/devices/frames/servo_line.h"

namespace doppel {
namespace {

constexpr Duration kPingPatience{3'000'000};
constexpr Duration kBoardPatience{300'000'000};  // a board answers when its loop gets there

// The board at the other end of the line; nullopt: none.
std::optional<FoundDevice> find_board(ByteLink& link, int rate) {
  FrameBytes hello;
  hello.add('\n');  // the end of what other protocols have sent before, which would damage the hello's line
  add_servo_line("H 1 5CA7", hello);
  link.discard();
  if (!link.write(hello.bytes())) return {};
  ServoLineReader reader;
  const Time deadline = link.now() + kBoardPatience;
  // A device that sends something else without end, such as a receiver of GPS, has bytes after the deadline,
  // too.
  for (bool in_time = true;; in_time = link.now() < deadline) {
    while (const auto body = reader.next()) {
      const ServoLineReply reply = parse_servo_reply(*body);
      const auto* const identity = std::get_if<ServoLineIdentity>(&reply);
      if (identity == nullptr) continue;
      FoundDevice out;
      out.protocol = ServoProtocol::servo_line;
      out.rate = rate;
      out.boot = identity->boot;
      out.board = fmt::format("doppel-servo {}, {} channels, {} ns per step", identity->firmware,
                              identity->channels, identity->step);
      return out;
    }
    if (!in_time) return {};
    std::array<std::uint8_t, 128> bytes{};
    const std::size_t count = link.read(bytes, deadline);
    if (count == 0) return {};
    reader.push(std::span(bytes).first(count));
  }
}

std::vector<FoundDevice> find_servos(ByteLink& link, ServoProtocol protocol, int rate, int last_id) {
  ServoBus bus(link, protocol, rate);
  bus.set_patience(kPingPatience);
  bus.notice_echo();
  std::vector<FoundDevice> out;
  for (const PingAnswer& answer : bus.ping_all(last_id)) {
    FoundDevice device;
    device.protocol = protocol;
    device.rate = rate;
    device.answer = answer;
    device.model = find_servo_model(protocol, answer.number);
    if (device.model != nullptr) {
      const std::array<BusServo, 1> servo{{{answer.id, device.model}}};
      std::array<ServoReading, 1> reading;
      bus.begin_cycle(servo, false);
      static_cast<void>(bus.read_all(reading));
      static_cast<void>(bus.read_health(reading));
      device.reading = reading.front();
    }
    out.push_back(std::move(device));
  }
  return out;
}

}  // namespace

std::vector<int> usual_rates(ServoProtocol protocol) {
  if (protocol == ServoProtocol::servo_line) return {115200, 921600};
  std::vector<int> out;
  for (const ServoModel& model : servo_models()) {
    if (model.protocol != protocol) continue;
    out.push_back(*model.rate_of(model.default_baud_index));
    for (const auto& [index, rate] : model.baud_rates) out.push_back(rate);
    break;
  }
  const int usual = out.front();
  out.erase(std::remove(out.begin() + 1, out.end(), usual), out.end());
  return out;
}

std::vector<FoundDevice> scan_link(ByteLink& link, const ScanOptions& options) {
  struct Try {
    ServoProtocol protocol;
    int rate;
  };
  std::vector<Try> tries;
  for (const ServoProtocol protocol : options.protocols) {
    for (const int rate : options.rates.empty() ? usual_rates(protocol) : options.rates)
      tries.push_back({protocol, rate});
  }
  // The usual rate of each protocol first.
  if (options.rates.empty())
    std::ranges::stable_sort(tries, {},
                             [](const Try& one) { return one.rate != usual_rates(one.protocol).front(); });
  for (std::size_t i = 0; i < tries.size(); ++i) {
    const auto [protocol, rate] = tries[i];
    const double done = static_cast<double>(i) / static_cast<double>(tries.size());
    if (options.progress && !options.progress(done, fmt::format("{} at {} bit/s", to_string(protocol), rate)))
      return {};
    if (!link.set_rate(rate) && !options.rates.empty()) continue;
    std::vector<FoundDevice> found;
    if (protocol == ServoProtocol::servo_line) {
      if (auto board = find_board(link, rate)) found.push_back(std::move(*board));
    } else {
      found = find_servos(link, protocol, rate, options.last_id);
    }
    if (!found.empty()) return found;
  }
  return {};
}

}  // namespace doppel
