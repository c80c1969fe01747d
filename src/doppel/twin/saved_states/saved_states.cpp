#include "doppel/twin/saved_states/saved_states.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "doppel/base/core/names.h"
#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/ros/messages/printable.h"

namespace doppel {
namespace {

constexpr const char* kStateOrigin = "state";
constexpr std::size_t kMaxStateName = 200;
constexpr auto kAutomaticStates = static_cast<std::size_t>(kRewindLength / kRewindPeriod) + 1;
constexpr std::size_t kMaxAutomaticBytes = std::size_t{128} << 20U;  // of the engine's part of them
constexpr std::size_t kMinAutomaticStates = 4;

// Fewer where the engine's state is large, as that of many objects in contact is.
std::size_t automatic_states(const Engine& engine) {
  const std::size_t each = std::max<std::size_t>(1, engine.state_bytes());
  return std::clamp(kMaxAutomaticBytes / each, kMinAutomaticStates, kAutomaticStates);
}

}  // namespace

SavedStates::SavedStates(TwinCore& core) : core_(core), node_(core.bus(), "/doppel") {
  serve();
}

std::shared_ptr<const SavedState> SavedStates::save_now() {
  auto out = std::make_shared<SavedState>();
  if (const Status saved = core_.save(*out); !saved)
    throw InputError("state.save", {}, "the twin cannot be saved: " + saved.why());
  return out;
}

Status SavedStates::restore_state(const SavedState& state) {
  const Time before = core_.now();
  if (Status restored = core_.restore(state); !restored) return restored;
  forget_later_than(Time::min(), core_.now());
  core_.log().note(kStateOrigin, fmt::format("restored: t = {:.3f} s is followed by t = {:.3f} s",
                                             to_seconds(before), to_seconds(core_.now())));
  return {};
}

Status SavedStates::save_named(const std::string& name, bool strict, std::string& done) {
  if (name.empty()) return Status::refused("a saved state needs a name");
  if (!is_printable_name(name))
    return Status::refused("the name of a state is text in UTF-8 without control characters");
  if (name.size() > kMaxStateName)
    return Status::refused(fmt::format("the name of a state has at most {} characters", kMaxStateName));
  if (!named_.contains(name) && named_.size() >= kMaxSavedStates)
    return Status::refused(fmt::format("there are {} saved states already; delete some", named_.size()));
  auto state = std::make_shared<SavedState>();
  if (Status saved = core_.save(*state); !saved) return saved;
  const std::vector<std::string>& unsaved = state->unsaved_controllers();
  const std::string names = fmt::format("{}", fmt::join(unsaved, ", "));
  if (strict && !unsaved.empty())
    return Status::refused(fmt::format(
        "these controllers do not implement saving: {}; without strict they are reactivated at a restore",
        names));
  done = fmt::format("saved '{}' at t = {:.3f} s", name, to_seconds(state->time()));
  if (!unsaved.empty())
    done += fmt::format("; reactivated at a restore, because they do not implement saving: {}", names);
  named_[name] = std::move(state);
  core_.log().note(kStateOrigin, done);
  return {};
}

Status SavedStates::restore_named(const std::string& name, std::string& done) {
  const auto found = named_.find(name);
  if (found == named_.end()) {
    std::vector<std::string> names;
    for (const auto& [known, state] : named_) names.push_back(known);
    return Status::refused(fmt::format("there is no saved state '{}'{}", name, did_you_mean(name, names)));
  }
  const Time before = core_.now();
  if (Status restored = restore_state(*found->second); !restored)
    return Status::refused(fmt::format("'{}' cannot be restored: {}", name, restored.why()));
  done = fmt::format("restored '{}': t = {:.3f} s is followed by t = {:.3f} s", name, to_seconds(before),
                     to_seconds(core_.now()));
  return {};
}

Status SavedStates::remove(const std::string& name) {
  return named_.erase(name) > 0 ? Status{}
                                : Status::refused(fmt::format("there is no saved state '{}'", name));
}

void SavedStates::keep(bool on) {
  keeps_ = on;
  next_ = Time::min();
  if (on) return;
  automatic_.clear();
  spare_.clear();
}

// Only the first states allocate: later ones are written into the oldest, which is forgotten.
void SavedStates::save_automatically(Time now) {
  next_ = now + kRewindPeriod;
  const std::size_t most = automatic_states(core_.engine());
  if (spare_.empty() && automatic_.size() < most) spare_.push_back(std::make_unique<SavedState>());
  if (spare_.empty()) {
    spare_.push_back(std::move(automatic_.front()));
    automatic_.erase(automatic_.begin());
  }
  const Status saved = core_.save(*spare_.back());
  why_not_ = saved.why();
  if (!saved) return;  // such as a diverged state, from which a rewind leads away
  automatic_.push_back(std::move(spare_.back()));
  spare_.pop_back();
}

// The next one is due at the usual time after the last one that stays.
void SavedStates::forget_later_than(Time time, Time now) {
  const auto later =
      std::ranges::find_if(automatic_, [time](const State& state) { return state->time() > time; });
  std::move(later, automatic_.end(), std::back_inserter(spare_));
  automatic_.erase(later, automatic_.end());
  next_ = automatic_.empty() ? now : automatic_.back()->time() + kRewindPeriod;
}

Status SavedStates::rewind(Duration back, std::string& done) {
  if (back < Duration::zero()) return Status::refused("a rewind goes back, by a time that is not negative");
  if (!keeps_) return Status::refused("no automatic states are kept; start without --no-rewind");
  const Time before = core_.now();
  const auto newer =
      std::ranges::find_if(automatic_, [&](const State& state) { return state->time() > before - back; });
  if (newer == automatic_.begin()) {
    if (automatic_.empty())
      return Status::refused("there is no automatic state" + (why_not_.empty() ? " yet" : ": " + why_not_));
    return Status::refused(fmt::format("the oldest automatic state is {:.3f} s old, of t = {:.3f} s",
                                       to_seconds(before - automatic_.front()->time()),
                                       to_seconds(automatic_.front()->time())));
  }
  const SavedState& state = **std::prev(newer);
  if (Status restored = core_.restore(state); !restored) return restored;
  const Time now = core_.now();
  forget_later_than(now, now);
  done = fmt::format("rewound by {:.3f} s: t = {:.3f} s is followed by t = {:.3f} s",
                     to_seconds(before - now), to_seconds(before), to_seconds(now));
  core_.log().note(kStateOrigin, done);
  return {};
}

void SavedStates::serve() {
  using doppel_msgs::srv::DeleteState;
  using doppel_msgs::srv::ListStates;
  using doppel_msgs::srv::RestoreState;
  using doppel_msgs::srv::Rewind;
  using doppel_msgs::srv::SaveState;
  const auto answer = [this](const Status& status, const std::string& done, const auto& respond) {
    respond({status.ok(), status ? done : status.why(), to_seconds(core_.now())});
  };
  node_.serve<SaveState>("~/save_state", [this, answer](const SaveState::Request& request,
                                                        const Responder<SaveState::Response>& respond) {
    std::string done;
    answer(save_named(request.name, request.strict, done), done, respond);
  });
  node_.serve<RestoreState>(
      "~/restore_state",
      [this, answer](const RestoreState::Request& request, const Responder<RestoreState::Response>& respond) {
        std::string done;
        answer(restore_named(request.name, done), done, respond);
      });
  node_.serve<Rewind>(
      "~/rewind", [this, answer](const Rewind::Request& request, const Responder<Rewind::Response>& respond) {
        std::string done;
        const bool fits = std::isfinite(request.seconds) && std::abs(request.seconds) < 1e6;
        answer(fits ? rewind(from_seconds(request.seconds), done)
                    : Status::refused("that is no number of seconds"),
               done, respond);
      });
  node_.serve<DeleteState>("~/delete_state", [this](const DeleteState::Request& request,
                                                    const Responder<DeleteState::Response>& respond) {
    const Status status = remove(request.name);
    respond({status.ok(), status ? "deleted" : status.why()});
  });
  node_.serve<ListStates>("~/list_states", [this](const ListStates::Request& /*request*/,
                                                  const Responder<ListStates::Response>& respond) {
    ListStates::Response response;
    for (const auto& [name, state] : named_) {
      response.names.push_back(name);
      response.sim_times.push_back(to_seconds(state->time()));
    }
    for (const State& state : automatic_) response.automatic.push_back(to_seconds(state->time()));
    respond(response);
  });
}

}  // namespace doppel
