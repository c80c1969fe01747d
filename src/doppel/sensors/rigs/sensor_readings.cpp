#include "doppel/sensors/rigs/sensor_readings.h"

#include <algorithm>
#include <limits>
#include <optional>

#include "doppel/sensors/rigs/detail/sensor_meter.h"
#include "doppel/sensors/rigs/detail/sensor_names.h"

namespace doppel {
namespace {

constexpr std::size_t kUsualTouches = 512;  // beyond which the loop allocates

}  // namespace

struct SensorReadings::Impl {
  void note(const Engine& engine, bool at_rest);

  // Of the period of this instant.
  [[nodiscard]] std::uint64_t number(std::size_t sensor, Time now) const {
    return static_cast<std::uint64_t>(std::max(now - starts[sensor], Duration{}) / period);
  }

  Duration period{};
  std::vector<std::string> instances, keys, types;   // of each sensor
  std::vector<Time> starts;                          // of the noise
  std::vector<std::unique_ptr<SensorMeter>> meters;  // nullptr: it has no values, or a range
  std::vector<std::unique_ptr<RangeReader>> ranges;  // nullptr: no range sensor
  std::vector<std::vector<double>> values;
  std::shared_ptr<const CompiledWorld> world;          // of which the motions are
  std::vector<std::optional<InstanceMotion>> motions;  // [instances]
  std::vector<Contact> before, none;
  bool lockstep = false, needs_contacts = false, needs_all = false, started = false, fresh = true;
  Time noted_end = Time::min();  // of the step that begins with the noted state
  Time read_at = Time::min();
};

namespace {

struct SavedReadings {
  struct One {
    std::string key, type;
    Time start{};
    SensorMeter::Memory meter;
    std::vector<double> values;
  };
  std::vector<One> sensors;
  std::vector<std::string> instances;  // of the motions
  std::vector<InstanceMotion::Noted> motions;
  std::vector<Contact> before;
  bool fresh = true;
  Time noted_end = Time::min(), read_at = Time::min();
};

}  // namespace

void SensorReadings::save(SavedSlot& slot) const {
  const Impl& present = *impl_;
  SavedReadings& out = value_in<SavedReadings>(slot);
  out.sensors.resize(present.meters.size());
  for (std::size_t i = 0; i < present.meters.size(); ++i) {
    SavedReadings::One& one = out.sensors[i];
    one.key = present.keys[i];
    one.type = present.types[i];
    one.start = present.starts[i];
    one.values = present.values[i];
    if (present.meters[i]) present.meters[i]->save(one.meter);
  }
  out.instances.clear();
  out.motions.resize(present.motions.size());
  for (std::size_t i = 0; i < present.motions.size(); ++i) {
    out.instances.push_back(present.world->instances()[i].name);
    if (present.motions[i]) out.motions[i] = present.motions[i]->noted();
  }
  out.before = present.before;
  out.fresh = present.fresh;
  out.noted_end = present.noted_end;
  out.read_at = present.read_at;
}

void SensorReadings::restore(const SavedPart& saved) {
  const auto* const before = value_of<SavedReadings>(&saved);
  if (before == nullptr) return;
  Impl& present = *impl_;
  bool same =
      before->sensors.size() == present.meters.size() && before->motions.size() == present.motions.size();
  for (std::size_t i = 0; i < present.meters.size(); ++i) {
    const auto one = std::ranges::find_if(before->sensors, [&](const SavedReadings::One& other) {
      return other.key == present.keys[i] && other.type == present.types[i];
    });
    if (one == before->sensors.end()) continue;
    present.starts[i] = one->start;
    if (one->values.size() == present.values[i].size()) present.values[i] = one->values;
    if (present.meters[i]) present.meters[i]->restore(one->meter);
  }
  for (std::size_t i = 0; same && i < present.motions.size(); ++i) {
    const InstanceMotion::Noted& noted = before->motions[i];
    same = before->instances[i] == present.world->instances()[i].name;
    if (!present.motions[i]) continue;
    same = same && noted.q.size() == present.motions[i]->noted().q.size() &&
           noted.v.size() == present.motions[i]->noted().v.size();
    if (same) present.motions[i]->set_noted(noted);
  }
  // Among other instances there is no state from which the last step began.
  if (!same) return state_written();
  present.before = before->before;
  present.fresh = before->fresh;
  present.noted_end = before->noted_end;
  present.read_at = before->read_at;
}

SensorReadings::SensorReadings(const std::vector<RigSensor>& sensors, const RigOptions& options,
                               const EarthFrame& earth, Duration period, RangeValues* ranges)
    : impl_(std::make_unique<Impl>()) {
  impl_->period = period;
  impl_->starts.resize(sensors.size());
  impl_->lockstep = options.lockstep;
  for (const RigSensor& sensor : sensors) {
    const CounterRandom random(options.seed, sensor_key(sensor) + "/state_interfaces");
    impl_->instances.push_back(sensor.instance);
    impl_->keys.push_back(sensor_key(sensor));
    impl_->types.push_back(sensor.description.type);
    impl_->meters.push_back(make_meter(sensor, MeterSettings{random, to_seconds(period), earth}));
    impl_->values.emplace_back(reading_names(sensor.description).size(),
                               std::numeric_limits<double>::quiet_NaN());
    const bool is_range = std::holds_alternative<RangeDescription>(sensor.description.what);
    impl_->ranges.push_back(is_range && ranges != nullptr ? std::make_unique<RangeReader>(ranges->of(sensor))
                                                          : nullptr);
    if (!impl_->meters.back()) continue;
    impl_->needs_contacts = impl_->needs_contacts || impl_->meters.back()->needs_contacts_before();
    impl_->needs_all = impl_->needs_all || impl_->meters.back()->needs_all_motions();
  }
  impl_->before.reserve(kUsualTouches);
}

SensorReadings::~SensorReadings() = default;

void SensorReadings::bind(const Engine& engine) {
  Impl& of = *impl_;
  of.world = engine.compiled();
  of.motions.clear();
  of.motions.resize(of.world->instances().size());
  of.noted_end = of.read_at = Time::min();
  for (std::size_t i = 0; i < of.meters.size(); ++i) {
    if (!of.meters[i]) continue;
    const int instance = of.world->find(of.instances[i]);
    of.meters[i]->bind(engine, instance);
    if (instance < 0) std::ranges::fill(of.values[i], std::numeric_limits<double>::quiet_NaN());
    if (instance >= 0)
      of.motions[static_cast<std::size_t>(instance)].emplace(*engine.instance(instance).made_of().model);
  }
  for (std::size_t i = 0; of.needs_all && i < of.motions.size(); ++i)
    if (!of.motions[i]) of.motions[i].emplace(*of.world->instances()[i].model);
  if (!std::exchange(of.started, true)) restart(engine);
}

void SensorReadings::restart(const Engine& engine) {
  for (const auto& meter : impl_->meters)
    if (meter) meter->restart(engine);
  std::ranges::fill(impl_->starts, engine.time());
  state_written();
}

void SensorReadings::state_written() {
  impl_->noted_end = impl_->read_at = Time::min();
  impl_->fresh = true;
}

void SensorReadings::resume(const SensorReadings& before, Time now) {
  const Impl& former = *before.impl_;
  for (std::size_t i = 0; i < impl_->meters.size(); ++i) {
    for (std::size_t j = 0; j < former.meters.size(); ++j) {
      if (!impl_->meters[i] || !former.meters[j] || impl_->keys[i] != former.keys[j] ||
          impl_->types[i] != former.types[j] || impl_->period != former.period)
        continue;
      impl_->starts[i] = former.starts[j];
      impl_->meters[i]->resume(*former.meters[j], impl_->number(i, now) + 1);
    }
  }
}

void SensorReadings::Impl::note(const Engine& engine, bool at_rest) {
  for (std::size_t i = 0; i < motions.size(); ++i) {
    if (!motions[i]) continue;
    const Instance instance = engine.instance(static_cast<int>(i));
    if (at_rest)
      motions[i]->note_at_rest(instance);
    else
      motions[i]->note(instance);
  }
  if (needs_contacts) engine.contacts(before);
}

void SensorReadings::before_step(const Engine& engine) {
  Impl& of = *impl_;
  if (of.meters.empty() || engine.compiled() != of.world) return;
  of.note(engine, false);
  of.noted_end = engine.time() + of.world->settings().step;
}

void SensorReadings::read(const Engine& engine) {
  Impl& of = *impl_;
  const Time now = engine.time();
  for (std::size_t i = 0; i < of.ranges.size(); ++i)
    if (of.ranges[i]) of.values[i][0] = of.ranges[i]->range();
  if (of.meters.empty() || engine.compiled() != of.world || of.read_at == now) return;
  // Instances came or went in this step, whose beginning is not known: the last values stay.
  if (of.noted_end != now && !of.fresh) return;
  of.read_at = now;
  of.fresh = false;
  const double h = to_seconds(of.world->settings().step);
  if (of.noted_end == now) {
    for (std::size_t i = 0; i < of.motions.size(); ++i)
      if (of.motions[i]) of.motions[i]->differentiate(engine.instance(static_cast<int>(i)), h);
  } else {
    of.note(engine, true);
  }
  const PhysicalState state{engine, now, now, of.motions, of.before, of.none};
  for (std::size_t i = 0; i < of.meters.size(); ++i) {
    if (!of.meters[i] || of.meters[i]->instance() < 0) continue;
    of.meters[i]->measure(state, of.number(i, now));
    std::ranges::copy(of.meters[i]->values(), of.values[i].begin());
  }
}

bool SensorReadings::repeatable(std::size_t sensor) const {
  return impl_->lockstep || !impl_->ranges[sensor];
}

std::span<const double> SensorReadings::values(std::size_t sensor) const {
  return impl_->values[sensor];
}

}  // namespace doppel
