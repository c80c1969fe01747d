#include "doppel/sensors/rigs/physical_rig.h"

#include <algorithm>
#include <set>
#include <string>
#include <utility>

#include "doppel/sensors/models/sample_schedule.h"
#include "doppel/sensors/rigs/detail/physical_sensor.h"
#include "doppel/sensors/rigs/detail/rig_node.h"

namespace doppel {
namespace {

// Contacts of one world beyond which the loop allocates.
constexpr std::size_t kUsualContacts = 512;
constexpr Duration kPhysicalWindow{1'000'000'000};  // in which samples are counted for the rate reached

}  // namespace

struct PhysicalRig::Impl {
  struct Entry {
    std::unique_ptr<PhysicalSensor> sensor;
    SampleSchedule schedule;
    std::uint64_t samples = 0, window_samples = 0;
    double reached = 0;  // Hz, over the last window
    bool noted = false;  // a sample is taken at the end of this step
  };

  Impl(Bus& the_bus, const Log& the_log, const RigOptions& the_options) : bus(the_bus), options(the_options) {
    log.add_sink([this, &the_log](const LogLine& line) {
      if (present.insert(line.text).second && !reported.contains(line.text))
        the_log.line(line.severity, line.origin, line.text, line.where);
    });
    before.reserve(kUsualContacts);
    contacts.reserve(kUsualContacts);
  }

  void bind(const Engine& engine);
  // The sensors with their topics in the node `in`. leaves_out: those whose topics have another type elsewhere.
  [[nodiscard]] std::vector<Entry> make_entries(const std::vector<RigSensor>& wanted, const Engine& engine,
                                                Node& in, bool leaves_out) const;
  // The present sensor in whose place this one is; nullptr: none.
  [[nodiscard]] const Entry* former_of(const Entry& entry) const;
  void note(const Engine& engine, int instance);
  // Returns whether one of the sensors needs the present contacts.
  bool differentiate(const Engine& engine);

  Bus& bus;
  Log log;                                  // leaves out what an edit has not changed
  std::set<std::string> reported, present;  // of the former sensors, of the present ones
  const RigOptions options;
  EarthFrame earth;
  std::unique_ptr<Node> node;
  std::vector<Entry> entries;
  std::shared_ptr<const CompiledWorld> world;          // of which the motions are
  std::vector<std::optional<InstanceMotion>> motions;  // [instances]
  std::vector<char> noted;                             // [instances]
  Time window_start{};
  Time noted_at = Time::min();  // the end of the step that begins with the noted state
  std::vector<Contact> before, contacts;
};

PhysicalRig::PhysicalRig(Bus& bus, const Log& log, const RigOptions& options)
    : impl_(std::make_unique<Impl>(bus, log, options)) {}
PhysicalRig::~PhysicalRig() = default;

bool PhysicalRig::empty() const {
  return impl_->entries.empty();
}

void PhysicalRig::Impl::bind(const Engine& engine) {
  world = engine.compiled();
  motions.clear();
  motions.resize(world->instances().size());
  noted.assign(motions.size(), 0);
  noted_at = Time::min();
  bool all = false;
  for (Entry& entry : entries) {
    const int instance = world->find(entry.sensor->sensor().instance);
    entry.sensor->bind(engine, instance);
    all = all || entry.sensor->needs_all_motions();
    if (instance >= 0)
      motions[static_cast<std::size_t>(instance)].emplace(*engine.instance(instance).made_of().model);
  }
  for (std::size_t i = 0; all && i < motions.size(); ++i)
    if (!motions[i]) motions[i].emplace(*world->instances()[i].model);
}

void PhysicalRig::set_earth(const EarthFrame& earth) {
  impl_->earth = earth;
}

std::vector<PhysicalRig::Impl::Entry> PhysicalRig::Impl::make_entries(const std::vector<RigSensor>& wanted,
                                                                      const Engine& engine, Node& in,
                                                                      bool leaves_out) const {
  std::vector<Entry> fresh;
  for (const RigSensor& sensor : wanted) {
    const std::string key = sensor_key(sensor);
    Entry entry;
    entry.schedule = SampleSchedule(sensor.description.rate, engine.world().settings().step);
    entry.schedule.restart(engine.time());
    const MeterSettings settings{CounterRandom(options.seed, key), entry.schedule.period(), earth};
    entry.sensor = made_or_left_out(sensor, in, leaves_out, log, [&](Node& node_of) {
      return make_physical_sensor(node_of, sensor, settings, log);
    });
    if (!entry.sensor) continue;
    if (const Entry* const old = former_of(entry)) {
      entry.schedule =
          old->schedule.continued(sensor.description.rate, engine.world().settings().step, engine.time());
      entry.samples = old->samples;
    }
    if (entry.schedule.limited()) {
      log.warning("sensors", key + " asks for " + std::to_string(sensor.description.rate) +
                                 " Hz, more than one sample a step; it takes one every step");
    }
    fresh.push_back(std::move(entry));
  }
  return fresh;
}

const PhysicalRig::Impl::Entry* PhysicalRig::Impl::former_of(const Entry& entry) const {
  const RigSensor& sensor = entry.sensor->sensor();
  const auto old = std::ranges::find_if(entries, [&](const Entry& one) {
    const SensorDescription& former = one.sensor->sensor().description;
    return sensor_key(one.sensor->sensor()) == sensor_key(sensor) && former.type == sensor.description.type &&
           former.rate == sensor.description.rate;
  });
  return old == entries.end() ? nullptr : &*old;
}

void PhysicalRig::set_sensors(const std::vector<RigSensor>& wanted, const Engine& engine,
                              const std::function<void()>& release_others) {
  Impl& rig = *impl_;
  rig.reported = std::exchange(rig.present, {});
  std::vector<Impl::Entry> fresh;
  const auto make = [&](Node& in, bool leaves_out) {
    fresh = rig.make_entries(wanted, engine, in, leaves_out);
  };
  auto node = renewed_node(rig.bus, rig.node, make, release_others);
  std::vector<const Impl::Entry*> before;  // in whose place each is; nullptr: none
  for (const Impl::Entry& entry : fresh) before.push_back(rig.former_of(entry));
  std::swap(rig.entries, fresh);
  if (rig.entries.empty()) node.reset();
  rig.node = std::move(node);
  rig.bind(engine);
  for (std::size_t i = 0; i < before.size(); ++i) {
    PhysicalSensor& sensor = *rig.entries[i].sensor;
    sensor.restart(engine);
    if (before[i] != nullptr) sensor.resume(*before[i]->sensor, before[i]->schedule.next());
  }
}

void PhysicalRig::instances_changed(const Engine& engine) {
  Impl& rig = *impl_;
  std::vector<Impl::Entry*> absent;
  for (Impl::Entry& entry : rig.entries)
    if (entry.sensor->instance() < 0) absent.push_back(&entry);
  rig.bind(engine);
  // One that comes back begins anew, so that it has no samples to make up.
  for (Impl::Entry* const entry : absent) {
    if (entry->sensor->instance() < 0) continue;
    entry->schedule.restart(engine.time());
    entry->sensor->restart(engine);
  }
}

void PhysicalRig::between_steps(Time now) {
  Impl& rig = *impl_;
  if (now < rig.window_start + kPhysicalWindow) return;
  for (Impl::Entry& entry : rig.entries) {
    entry.reached = static_cast<double>(entry.window_samples) / to_seconds(now - rig.window_start);
    entry.window_samples = 0;
  }
  rig.window_start = now;
}

void PhysicalRig::reset(const Engine& engine) {
  Impl& rig = *impl_;
  rig.noted_at = Time::min();
  rig.window_start = engine.time();
  for (Impl::Entry& entry : rig.entries) {
    entry.window_samples = 0;
    entry.schedule.restart(engine.time());
    entry.sensor->restart(engine);
  }
}

namespace {

struct SavedPhysicalRig {
  struct One {
    std::string key, type;
    SampleSchedule schedule;
    std::uint64_t samples = 0, window_samples = 0;
    double reached = 0;
    SavedSlot sensor;
  };
  std::vector<One> sensors;
  Time window_start{};
};

}  // namespace

void PhysicalRig::save(SavedSlot& slot) const {
  SavedPhysicalRig& out = value_in<SavedPhysicalRig>(slot);
  out.window_start = impl_->window_start;
  out.sensors.resize(impl_->entries.size());
  for (std::size_t i = 0; i < out.sensors.size(); ++i) {
    const Impl::Entry& entry = impl_->entries[i];
    SavedPhysicalRig::One& one = out.sensors[i];
    one.key = sensor_key(entry.sensor->sensor());
    one.type = entry.sensor->sensor().description.type;
    one.schedule = entry.schedule;
    one.samples = entry.samples;
    one.window_samples = entry.window_samples;
    one.reached = entry.reached;
    entry.sensor->save(one.sensor);
  }
}

void PhysicalRig::restore(const SavedPart& saved) {
  const auto* const before = value_of<SavedPhysicalRig>(&saved);
  if (before == nullptr) return;
  Impl& rig = *impl_;
  rig.noted_at = Time::min();
  rig.window_start = before->window_start;
  for (Impl::Entry& entry : rig.entries) {
    const RigSensor& sensor = entry.sensor->sensor();
    const auto one = std::ranges::find_if(before->sensors, [&](const SavedPhysicalRig::One& other) {
      return other.key == sensor_key(sensor) && other.type == sensor.description.type;
    });
    if (one == before->sensors.end()) continue;
    entry.schedule = one->schedule;
    entry.samples = one->samples;
    entry.window_samples = one->window_samples;
    entry.reached = one->reached;
    entry.noted = false;
    entry.sensor->restore(*one->sensor);
  }
}

void PhysicalRig::Impl::note(const Engine& engine, int instance) {
  const auto i = static_cast<std::size_t>(instance);
  if (noted[i] != 0) return;
  noted[i] = 1;
  motions[i]->note(engine.instance(instance));
}

void PhysicalRig::before_step(const Engine& engine) {
  Impl& rig = *impl_;
  if (rig.entries.empty() || engine.compiled() != rig.world) return;
  // Accelerations are differences over the step that ends at a sample, so that the velocities at its
  // beginning are noted only for the sensors that are due then and have a subscriber.
  const Time then = engine.time() + rig.world->settings().step;
  bool any = false, all = false, touches = false;
  for (Impl::Entry& entry : rig.entries) {
    entry.noted = entry.sensor->instance() >= 0 && entry.schedule.due(then) && entry.sensor->wanted();
    if (!entry.noted) continue;
    if (!any) std::ranges::fill(rig.noted, 0);
    any = true;
    rig.note(engine, entry.sensor->instance());
    // A force-torque sensor that carries a grasped object weighs it too: the motions of all instances are
    // needed.
    all = all || (entry.sensor->needs_all_motions() && !engine.attachments().empty());
    touches = touches || entry.sensor->needs_contacts_before();
  }
  if (!any) return;
  for (int i = 0; all && i < static_cast<int>(rig.motions.size()); ++i) rig.note(engine, i);
  if (touches) engine.contacts(rig.before);
  rig.noted_at = then;
}

bool PhysicalRig::Impl::differentiate(const Engine& engine) {
  const double h = to_seconds(world->settings().step);
  for (int i = 0; i < static_cast<int>(motions.size()); ++i)
    if (noted[static_cast<std::size_t>(i)] != 0)
      motions[static_cast<std::size_t>(i)]->differentiate(engine.instance(i), h);
  return std::ranges::any_of(
      entries, [](const Entry& entry) { return entry.noted && entry.sensor->needs_contacts(); });
}

Time PhysicalRig::next() const {
  Time next = Time::max();
  for (const Impl::Entry& entry : impl_->entries)
    if (entry.sensor->instance() >= 0)
      next = std::min({next, entry.schedule.at(entry.schedule.next()), entry.sensor->next_release()});
  return next;
}

Time PhysicalRig::publish(const Engine& engine) {
  Impl& rig = *impl_;
  if (rig.entries.empty() || engine.compiled() != rig.world) return Time::max();
  const Time now = engine.time();
  // A state that was set between two steps, by a service or a reset, has no difference; that sample is
  // omitted.
  const bool stepped = rig.noted_at == now;
  rig.noted_at = Time::min();
  if (stepped && rig.differentiate(engine)) engine.contacts(rig.contacts);
  const PhysicalState state{engine, now, rig.bus.stamp(now), rig.motions, rig.before, rig.contacts};
  for (Impl::Entry& entry : rig.entries) {
    if (entry.sensor->instance() < 0) continue;
    if (entry.schedule.due(now)) {
      const std::uint64_t sample = entry.schedule.take(now);
      if (stepped && entry.noted) {
        entry.sensor->publish(state, sample);
        ++entry.samples;
        ++entry.window_samples;
      }
    }
    entry.noted = false;
    entry.sensor->release(now);
  }
  return next();
}

void PhysicalRig::refresh(std::span<doppel_msgs::msg::Sensor> list) const {
  for (std::size_t i = 0; i < list.size(); ++i) {
    list[i].reached = impl_->entries[i].reached;
    list[i].samples = impl_->entries[i].samples;
  }
}

std::vector<RigStatus> PhysicalRig::status() const {
  std::vector<RigStatus> out;
  for (const Impl::Entry& entry : impl_->entries) {
    RigStatus& status = out.emplace_back();
    status.sensor = listed(entry.sensor->sensor());
    status.sensor.topics = {entry.sensor->topic()};
    status.sensor.frame = entry.sensor->frame();
    status.hash = entry.sensor->hash();
    status.sensor.reached = entry.reached;
    status.sensor.samples = entry.samples;
  }
  return out;
}

}  // namespace doppel
