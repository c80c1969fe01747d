// Fuzz target: what two clients of one twin send, in any order, with the loop's steps between. Each frame
// begins with a byte that selects its client, its kind and the step after it, and two of its length.
#include <cstdint>
#include <vector>

#include "doppel/ros/messages/std_msgs.h"
#include "doppel/ros/messages/std_srvs.h"
#include "doppel/ros/server/hub.h"

namespace {

using namespace doppel;

struct Link final : ClientLink {
  void send(OutgoingFrame frame) override { bytes += frame.size(); }
  [[nodiscard]] std::size_t unsent_assets() const override { return 0; }
  std::size_t bytes = 0;
};

void add_interfaces(Node& node) {
  node.subscribe<std_msgs::msg::Float64>("/command", [](const std_msgs::msg::Float64&) {});
  node.serve<std_srvs::srv::SetBool>("~/enable", [](const auto& request, const auto& respond) {
    respond({.success = request.data, .message = ""});
  });
  node.serve<std_srvs::srv::Trigger>("~/never", [](const auto&, const auto&) {});
  node.parameters().declare("rate", std::int64_t{100}, {.description = "Hz"});
  node.parameters().declare("name", std::string("arm"), {.read_only = true});
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::vector<std::function<void()>> tasks;
  Bus bus;
  Node node(bus, "/arm");
  add_interfaces(node);
  const auto text = node.advertise<std_msgs::msg::String>("/text", {.depth = 1, .latched = true});
  Link links[2];
  HubOptions options;
  options.ring_bytes = std::size_t{1} << 20;
  Hub hub(bus, options, [&](std::function<void()> task) { tasks.push_back(std::move(task)); });
  Hub::ClientId clients[] = {hub.join(links[0]), hub.join(links[1])};
  const auto step = [&] {
    bus.set_now(bus.now() + std::chrono::milliseconds(1));
    bus.spin();
    text.publish({.data = "a"}, bus.now());
    for (const auto& task : std::exchange(tasks, {})) task();
    while (hub.pump(100)) {
    }
    hub.tick();
  };
  step();
  constexpr std::size_t kHead = 3;
  while (size > kHead) {
    const std::uint8_t kind = data[0];
    const std::size_t length = std::min<std::size_t>(data[1] | (data[2] << 8), size - kHead);
    Hub::ClientId& client = clients[kind & 1];
    const auto frame = std::as_bytes(std::span(data + kHead, length));
    if ((kind & 2) != 0) {
      hub.on_binary(client, frame);
    } else {
      hub.on_text(client, {reinterpret_cast<const char*>(frame.data()), length});
    }
    if ((kind & 4) != 0) step();
    // A client that leaves with its requests under way, and the next one.
    if ((kind & 8) != 0) {
      hub.leave(client);
      client = hub.join(links[kind & 1]);
    }
    data += kHead + length;
    size -= kHead + length;
  }
  step();
  return 0;
}
