#include "doppel/twin/journal/input_journal.h"

namespace doppel {
namespace {

constexpr Duration kHashPeriod{1'000'000'000};

using doppel_msgs::msg::Input;

static_assert(Input::MESSAGE == static_cast<int>(BusInput::Kind::message));
static_assert(Input::CALL == static_cast<int>(BusInput::Kind::call));
static_assert(Input::PARAMETER == static_cast<int>(BusInput::Kind::parameter));
static_assert(Input::OUTCOME == static_cast<int>(BusInput::Kind::outcome));
static_assert(Input::EDIT == static_cast<int>(BusInput::Kind::edit));

}  // namespace

// Nothing that a client asks for may be missing in the journal, so that its history has no depth.
InputJournal::InputJournal(TwinCore& core)
    : core_(core),
      node_(core.bus(), "/doppel"),
      inputs_(node_.advertise<Input>(kInputsTopic, {.keep_all = true})),
      hashes_(node_.advertise<doppel_msgs::msg::StateHash>(kStateHashTopic)) {
  core.bus().observe_inputs([this](const BusInput& input) { note(input); });
}

void InputJournal::note(const BusInput& input) {
  if (!inputs_.has_listeners()) return;
  message_.step = core_.steps_taken();
  message_.batch = batch_;
  message_.stamp_offset = (core_.bus().stamp(Time{}) - Time{}).count();
  message_.kind = static_cast<std::uint8_t>(input.kind);
  message_.source = input.source;
  message_.target = input.target;
  message_.type = input.type;
  message_.data.resize(input.data.size());
  std::ranges::transform(input.data, message_.data.begin(),
                         [](std::byte byte) { return std::to_integer<std::uint8_t>(byte); });
  inputs_.publish(message_, core_.bus().now());
}

// In the loop.
Time InputJournal::publish(Time now) {
  if (hashes_.has_listeners())
    hashes_.publish({to_time_msg(now), core_.steps_taken(), core_.state_hash()}, now);
  return std::chrono::floor<std::chrono::seconds>(now) + kHashPeriod;
}

}  // namespace doppel
