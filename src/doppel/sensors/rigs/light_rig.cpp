#include "doppel/sensors/rigs/light_rig.h"

#include <algorithm>
#include <deque>

#include "doppel/base/core/fnv_hash.h"
#include "doppel/sensors/models/sample_schedule.h"
#include "doppel/sensors/rigs/detail/rig_node.h"
#include "doppel/sensors/rigs/detail/rig_worker.h"
#include "doppel/sensors/rigs/detail/world_scene.h"

namespace doppel {
namespace {

constexpr Duration kRateWindow{1'000'000'000};

}  // namespace

struct LightRig::Impl {
  struct Entry {
    std::shared_ptr<LightSensor> sensor;
    SampleSchedule schedule;
    int instance = -1, link = 0, body = -1;
    std::uint64_t samples = 0, left_out = 0, failed = 0, hash = kEmptyHash;
    double cost = 0;
    std::uint64_t window_samples = 0;
    double reached = 0;
  };
  // A message whose time has not come, because of its sensor's latency.
  struct Waiting {
    std::size_t sensor = 0;
    LightMessage message;
    Time stamp{}, due{};
  };

  Impl(Bus& the_bus, const Log& the_log, const RigOptions& the_options)
      : bus(the_bus), log(the_log), options(the_options) {}

  struct Saved;

  void collect();
  void drop_jobs();
  void wait_until(Time due, Waiting message);
  // The sensors with their topics in the node `in`. leaves_out: those whose topics have another type elsewhere.
  [[nodiscard]] std::vector<Entry> make_entries(const std::vector<RigSensor>& wanted, const Engine& engine,
                                                Node& in, bool leaves_out) const;
  // Messages that wait are sent by the sensors in the place of theirs. Those of a sensor whose values change
  // are dropped, so that what comes after the edit has its values, in the order of the stamps.
  void keep_waiting(const std::vector<Entry>& fresh);
  void publish(std::size_t sensor, const LightMessage& message, Time stamp);
  void find_bodies(const Engine& engine);
  void reserve_jobs();
  [[nodiscard]] doppel_msgs::msg::Sensor status_of(const Entry& entry) const;

  Bus& bus;
  const Log& log;
  RigOptions options;
  std::shared_ptr<RangeValues> ranges;  // nullptr: no controller reads them
  std::unique_ptr<Node> node;
  Time window_start{};
  std::vector<std::shared_ptr<LightSensor>> sensors;  // of entries, by index: what the worker reads
  std::vector<Entry> entries;
  std::shared_ptr<const CompiledWorld> world;  // of which the bodies are
  std::deque<Waiting> waiting;
  std::unique_ptr<RigWorker> worker;  // made with the first sensor; last, because it uses the members above
};

LightRig::LightRig(Bus& bus, const Log& log, const RigOptions& options)
    : impl_(std::make_unique<Impl>(bus, log, options)) {}
LightRig::~LightRig() = default;

bool LightRig::empty() const {
  return impl_->entries.empty();
}

std::uint64_t LightRig::rays_cast() const {
  return impl_->worker ? impl_->worker->rays_cast() : 0;
}

void LightRig::Impl::find_bodies(const Engine& engine) {
  world = engine.compiled();
  const auto& instances = world->instances();
  for (Entry& entry : entries) {
    entry.instance = world->find(entry.sensor->sensor().instance);
    entry.link = entry.sensor->sensor().link;
    // Bodies are numbered as in read_poses(): the world first, then the links of all instances in their
    // order.
    entry.body = 1;
    for (int i = 0; i < entry.instance; ++i)
      entry.body += static_cast<int>(instances[static_cast<std::size_t>(i)].model->links.size());
    entry.body += entry.link;
  }
}

doppel_msgs::msg::Sensor LightRig::Impl::status_of(const Entry& entry) const {
  doppel_msgs::msg::Sensor out = listed(entry.sensor->sensor());
  out.topics = entry.sensor->topics();
  out.reached = entry.reached;
  out.samples = entry.samples;
  out.left_out = entry.left_out;
  out.cost = entry.cost;
  return out;
}

void LightRig::set_ranges(std::shared_ptr<RangeValues> ranges) {
  impl_->ranges = std::move(ranges);
}

std::vector<LightRig::Impl::Entry> LightRig::Impl::make_entries(const std::vector<RigSensor>& wanted,
                                                                const Engine& engine, Node& in,
                                                                bool leaves_out) const {
  std::vector<Entry> fresh;
  for (const RigSensor& sensor : wanted) {
    const double rate = sensor.description.rate;
    const std::string key = sensor_key(sensor);
    Entry entry;
    entry.sensor = made_or_left_out(sensor, in, leaves_out, log, [&](Node& node_of) {
      return make_light_sensor(node_of, sensor, options);
    });
    if (!entry.sensor) continue;
    if (ranges && std::holds_alternative<RangeDescription>(sensor.description.what))
      entry.sensor->report_to(ranges->of(sensor));
    const auto old = std::find_if(entries.begin(), entries.end(), [&](const Entry& one) {
      return sensor_key(one.sensor->sensor()) == key && one.sensor->sensor().description.rate == rate;
    });
    if (old != entries.end()) {
      // A sensor that an edit leaves in its place keeps its sequence of samples, and with it noise,
      // counters and hash.
      auto made = std::move(entry.sensor);
      if (old->sensor->sensor().description.type == sensor.description.type)
        made->resume(*old->sensor, old->schedule.next());
      entry = *old;
      entry.sensor = std::move(made);
      entry.schedule = old->schedule.continued(rate, engine.world().settings().step, engine.time());
    } else {
      entry.schedule = SampleSchedule(rate, engine.world().settings().step);
      entry.schedule.restart(engine.time());
      entry.sensor->restart();
      if (entry.schedule.limited())
        log.warning("sensors", key + " asks for " + std::to_string(rate) +
                                   " Hz, more than one sample a step; it takes one every step");
    }
    fresh.push_back(std::move(entry));
  }
  return fresh;
}

void LightRig::set_sensors(const std::vector<RigSensor>& wanted, const Engine& engine) {
  Impl& rig = *impl_;
  if (rig.worker) {
    rig.worker->wait_idle();
    rig.collect();
  }
  rig.options.step = engine.world().settings().step;
  std::vector<Impl::Entry> fresh;
  auto node = renewed_node(rig.bus, rig.node, [&](Node& in, bool leaves_out) {
    fresh = rig.make_entries(wanted, engine, in, leaves_out);
  });
  rig.keep_waiting(fresh);
  rig.entries = std::move(fresh);
  if (rig.entries.empty()) node.reset();
  rig.node = std::move(node);
  rig.sensors.clear();
  for (const Impl::Entry& entry : rig.entries) rig.sensors.push_back(entry.sensor);
  rig.find_bodies(engine);
  if (!rig.worker && !rig.entries.empty())
    rig.worker = std::make_unique<RigWorker>(rig.sensors, rig.options.threads);
  rig.reserve_jobs();
}

// Memory for the poses of all bodies, so that the loop allocates none.
void LightRig::Impl::reserve_jobs() {
  if (!worker) return;
  std::size_t bodies = 1;
  for (const ModelInstance& instance : world->instances()) bodies += instance.model->links.size();
  worker->reserve(sensors.size(), bodies);
}

void LightRig::release_topics() {
  if (impl_->worker) {
    impl_->worker->wait_idle();
    impl_->collect();
  }
  impl_->node.reset();
}

void LightRig::instances_changed(const Engine& engine) {
  impl_->find_bodies(engine);
  impl_->reserve_jobs();
}

void LightRig::after_step(Time now, const Engine& engine) {
  Impl& rig = *impl_;
  if (rig.entries.empty() || engine.compiled() != rig.world) return;
  RigJob* job = nullptr;
  bool behind = false;
  for (std::size_t i = 0; i < rig.entries.size(); ++i) {
    Impl::Entry& entry = rig.entries[i];
    if (entry.instance < 0 || !entry.schedule.due(now)) continue;
    // The number counts also samples that nobody reads, so that the noise of a sample does not depend on
    // who has subscribed.
    const std::uint64_t number = entry.schedule.take(now);
    const OutletSet wanted = entry.sensor->wanted();
    if (wanted.none()) continue;
    if (job == nullptr && !behind) {
      if (rig.options.lockstep && rig.worker->free_slot() == nullptr) {
        rig.worker->wait_idle();
        rig.collect();
      }
      job = rig.worker->free_slot();
      behind = job == nullptr;
      if (job != nullptr) job->samples.clear();
    }
    // A worker that is late must not hold up the loop: its samples are dropped and counted, except in
    // lockstep, where time waits for it.
    if (behind) {
      ++entry.left_out;
      continue;
    }
    const Instance instance = engine.instance(entry.instance);
    const FrameVelocity velocity = instance.link_velocity(entry.link);
    job->samples.push_back({i,
                            number,
                            wanted,
                            {instance.link_pose(entry.link), velocity.linear_W, velocity.angular_W},
                            entry.body});
  }
  if (job == nullptr) return;
  job->now = now;
  // All poses are copied here, because the loop goes on while the worker renders.
  job->stamp = rig.bus.stamp(now);
  job->world = rig.world;
  read_poses(engine, job->poses);
  rig.worker->submit();
  if (rig.options.lockstep) rig.worker->wait_idle();
}

void LightRig::Impl::publish(std::size_t sensor, const LightMessage& message, Time stamp) {
  entries[sensor].sensor->outlet(message.outlet).publish(message.cdr, stamp);
}

// Behind those that are due before it or with it, because latencies differ.
void LightRig::Impl::wait_until(Time due, Waiting message) {
  const auto behind =
      std::find_if(waiting.begin(), waiting.end(), [&](const Waiting& other) { return other.due > due; });
  waiting.insert(behind, std::move(message));
}

void LightRig::Impl::keep_waiting(const std::vector<Entry>& fresh) {
  std::erase_if(waiting, [&](Waiting& message) {
    const RigSensor& former = entries[message.sensor].sensor->sensor();
    const auto now = std::ranges::find_if(
        fresh, [&](const Entry& entry) { return same_values(entry.sensor->sensor(), former); });
    message.sensor = static_cast<std::size_t>(now - fresh.begin());
    return now == fresh.end();
  });
}

void LightRig::Impl::collect() {
  if (!worker) return;
  for (RigJob* job = worker->done(); job != nullptr; job = worker->done()) {
    for (std::size_t s = 0; s < job->samples.size(); ++s) {
      const std::size_t index = job->samples[s].sensor;
      Entry& entry = entries[index];
      if (!job->failures[s].empty()) {
        ++entry.failed;
        continue;
      }
      ++entry.samples;
      ++entry.window_samples;
      entry.cost = job->costs[s];
      const Duration latency = from_seconds(entry.sensor->sensor().description.latency);
      // The worker destroys them, so that the loop frees no memory.
      for (LightMessage& message : job->messages[s]) {
        entry.hash = fnv_mixed(entry.hash, message.hash);
        if (latency > Duration{})
          wait_until(job->now + latency, {index, std::move(message), job->now, job->now + latency});
        else
          publish(index, message, job->now);
      }
    }
    for (const Diagnostic& one : job->reports.all()) log.line(one.severity, "sensors", one.str());
    job->world.reset();
    worker->release();
  }
}

void LightRig::between_steps(Time now) {
  Impl& rig = *impl_;
  if (rig.entries.empty()) return;
  rig.collect();
  while (!rig.waiting.empty() && rig.waiting.front().due <= now) {
    const Impl::Waiting first = std::move(rig.waiting.front());
    rig.waiting.pop_front();
    rig.publish(first.sensor, first.message, first.stamp);
  }
  if (now < rig.window_start + kRateWindow) return;
  const double window = to_seconds(now - rig.window_start);
  for (Impl::Entry& entry : rig.entries) {
    entry.reached = window > 0 ? static_cast<double>(entry.window_samples) / window : 0;
    entry.window_samples = 0;
  }
  rig.window_start = now;
}

// Samples of a time that is no more.
void LightRig::Impl::drop_jobs() {
  if (!worker) return;
  worker->wait_idle();
  while (worker->done() != nullptr) worker->release();
}

void LightRig::reset(Time now) {
  Impl& rig = *impl_;
  rig.drop_jobs();
  rig.waiting.clear();
  rig.window_start = now;
  for (Impl::Entry& entry : rig.entries) {
    entry.schedule.restart(now);
    entry.window_samples = 0;
    entry.sensor->restart();
  }
}

struct LightRig::Impl::Saved {
  struct One {
    std::string key, type;
    SampleSchedule schedule;
    std::uint64_t samples = 0, left_out = 0, failed = 0, hash = 0, window_samples = 0;
    double cost = 0, reached = 0;
    LightSensor::Memory sensor;
  };
  std::vector<One> sensors;
  std::deque<Waiting> waiting;
  Time window_start{};
};

void LightRig::save(SavedSlot& slot) {
  Impl& rig = *impl_;
  if (rig.options.lockstep) rig.collect();
  Impl::Saved& out = value_in<Impl::Saved>(slot);
  out.waiting = rig.waiting;
  out.window_start = rig.window_start;
  out.sensors.resize(rig.entries.size());
  for (std::size_t i = 0; i < out.sensors.size(); ++i) {
    const Impl::Entry& entry = rig.entries[i];
    Impl::Saved::One& one = out.sensors[i];
    one.key = sensor_key(entry.sensor->sensor());
    one.type = entry.sensor->sensor().description.type;
    one.schedule = entry.schedule;
    one.samples = entry.samples;
    one.left_out = entry.left_out;
    one.failed = entry.failed;
    one.hash = entry.hash;
    one.window_samples = entry.window_samples;
    one.cost = entry.cost;
    one.reached = entry.reached;
    one.sensor = entry.sensor->memory();
  }
}

void LightRig::restore(const SavedPart& saved) {
  const auto* const before = value_of<Impl::Saved>(&saved);
  if (before == nullptr) return;
  Impl& rig = *impl_;
  rig.drop_jobs();
  rig.window_start = before->window_start;
  std::vector<std::size_t> present(before->sensors.size(), rig.entries.size());
  for (std::size_t i = 0; i < rig.entries.size(); ++i) {
    Impl::Entry& entry = rig.entries[i];
    const RigSensor& sensor = entry.sensor->sensor();
    const auto one = std::ranges::find_if(before->sensors, [&](const Impl::Saved::One& other) {
      return other.key == sensor_key(sensor) && other.type == sensor.description.type;
    });
    if (one == before->sensors.end()) continue;
    present[static_cast<std::size_t>(one - before->sensors.begin())] = i;
    entry.schedule = one->schedule;
    entry.samples = one->samples;
    entry.left_out = one->left_out;
    entry.failed = one->failed;
    entry.hash = one->hash;
    entry.window_samples = one->window_samples;
    entry.cost = one->cost;
    entry.reached = one->reached;
    entry.sensor->restore(one->sensor);
  }
  rig.waiting = before->waiting;
  for (Impl::Waiting& message : rig.waiting) message.sensor = present[message.sensor];
  std::erase_if(rig.waiting,
                [&](const Impl::Waiting& message) { return message.sensor == rig.entries.size(); });
}

std::uint64_t LightRig::failed(std::size_t sensor) const {
  return impl_->entries[sensor].failed;
}

void LightRig::refresh(std::span<doppel_msgs::msg::Sensor> list) const {
  for (std::size_t i = 0; i < list.size(); ++i) {
    const Impl::Entry& entry = impl_->entries[i];
    list[i].reached = entry.reached;
    list[i].samples = entry.samples;
    list[i].left_out = entry.left_out;
    list[i].cost = entry.cost;
  }
}

std::vector<RigStatus> LightRig::status() const {
  std::vector<RigStatus> out;
  for (const Impl::Entry& entry : impl_->entries) out.push_back({impl_->status_of(entry), entry.hash});
  return out;
}

}  // namespace doppel
