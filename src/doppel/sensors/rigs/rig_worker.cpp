#include "doppel/sensors/rigs/detail/rig_worker.h"

#include <algorithm>
#include <ctime>
#include <stdexcept>
#include <utility>

#include "doppel/base/core/fnv_hash.h"
#include "doppel/base/core/guarded_thread.h"
#include "doppel/base/core/thrown.h"

namespace doppel {
namespace {

double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace

RigWorker::RigWorker(const std::vector<std::shared_ptr<LightSensor>>& sensors, int threads,
                     MakeScene make_scene)
    : sensors_(sensors), make_scene_(std::move(make_scene)) {
  // An exception of a job is reported with it; nothing else on these threads throws.
  const auto nothing_else = [](const std::string& /*why*/) {};
  try {
    for (int i = 1; i < threads; ++i)
      assistants_.push_back(guarded_thread([this] { assist(); }, nothing_else));
    thread_ = guarded_thread([this] { run(); }, nothing_else);
  } catch (...) {
    finish();
    throw;
  }
}

RigWorker::~RigWorker() {
  finish();
}

void RigWorker::finish() {
  ends_ = true;
  work_.release();
  if (thread_.joinable()) thread_.join();  // before its assistants, which it may still be waiting for
  assistants_end_ = true;
  help_.release(static_cast<std::ptrdiff_t>(assistants_.size()));
  for (std::thread& assistant : assistants_) assistant.join();
}

void RigWorker::reserve(std::size_t samples, std::size_t bodies) {
  max_samples_ = samples;
  max_bodies_ = bodies;
  for (std::size_t free = submitted_; free < released_ + kSlots; ++free) make_room(slots_[free % kSlots]);
}

void RigWorker::make_room(RigJob& job) const {
  job.samples.reserve(max_samples_);
  job.poses.reserve(max_bodies_);
}

RigJob* RigWorker::free_slot() {
  return submitted_ - released_ < kSlots ? &slots_[submitted_ % kSlots] : nullptr;
}

void RigWorker::submit() {
  ++submitted_;
  work_.release();
}

RigJob* RigWorker::done() {
  return finished_.load(std::memory_order_acquire) > released_ ? &slots_[released_ % kSlots] : nullptr;
}

void RigWorker::release() {
  make_room(slots_[released_ % kSlots]);
  ++released_;
}

void RigWorker::wait_idle() const {
  for (std::size_t seen = finished_; seen != submitted_; seen = finished_) finished_.wait(seen);
}

void RigWorker::run() {
  while (true) {
    work_.acquire();
    if (ends_) return;
    RigJob& job = slots_[finished_ % kSlots];
    try {
      work_on(job);
    } catch (...) {  // no memory even for a report: the job has no samples
      job.samples.clear();
    }
    ++finished_;
    finished_.notify_all();
  }
}

void RigWorker::work_on(RigJob& job) {
  job.messages.resize(job.samples.size());
  job.costs.assign(job.samples.size(), 0);
  job.failures.assign(job.samples.size(), {});
  for (auto& messages : job.messages) messages.clear();
  job.reports = {};
  try {
    make(job);
    report_failures(job);
  } catch (...) {
    const std::string why = thrown_text();
    job.failures.assign(job.samples.size(), why);
    report(job, {}, "cameras, lidars and ranges have no scene and publish nothing: " + why);
  }
}

void RigWorker::report(RigJob& job, const SourceLocation& where, const std::string& text) {
  if (reported_.insert(text).second) job.reports.error("sensors.failed", where, text);
}

void RigWorker::report_failures(RigJob& job) {
  for (std::size_t i = 0; i < job.samples.size(); ++i) {
    if (job.failures[i].empty()) continue;
    const RigSensor& sensor = sensors_[job.samples[i].sensor]->sensor();
    report(job, sensor.description.source,
           "the sensor '" + sensor_key(sensor) + "' publishes nothing: " + job.failures[i]);
  }
}

void RigWorker::renew_scene(RigJob& job) {
  if (scene_of_ != job.world) {
    scene_of_ = job.world;
    scene_failure_.clear();
    try {
      const auto scene = make_scene_(*job.world, job.reports);
      caster_ = make_ray_caster(scene);
      objects_ = std::make_unique<const ObjectLabels>(scene);
    } catch (...) {
      scene_failure_ = thrown_text();
    }
  }
  if (!scene_failure_.empty()) throw std::runtime_error(scene_failure_);
}

void RigWorker::make_sample(RigJob& job, std::size_t index) {
  const double before = cpu_seconds();
  auto& messages = job.messages[index];
  job.samples[index].bodies = job.poses;
  job.samples[index].objects = objects_.get();
  sensors_[job.samples[index].sensor]->make(*caster_, job.samples[index], job.stamp, messages);
  for (LightMessage& message : messages) message.hash = fnv_hash(*message.cdr);
  job.costs[index] = cpu_seconds() - before;
}

void RigWorker::share_samples() {
  for (std::size_t i = next_sample_++; i < job_->samples.size(); i = next_sample_++) {
    try {
      make_sample(*job_, i);
    } catch (...) {
      note_failure(i);
    }
  }
}

void RigWorker::note_failure(std::size_t index) noexcept {
  job_->messages[index].clear();
  try {
    job_->failures[index] = thrown_text();
  } catch (...) {
    job_->failures[index] = "out of memory";  // short enough to need none
  }
}

void RigWorker::assist() {
  while (true) {
    help_.acquire();
    if (assistants_end_) return;
    share_samples();
    --busy_;
    busy_.notify_all();
  }
}

void RigWorker::make(RigJob& job) {
  renew_scene(job);
  caster_->set_poses(job.poses);
  job_ = &job;
  next_sample_ = 0;
  const std::size_t helpers = std::min(assistants_.size(), job.samples.size() - 1);
  busy_ = helpers;
  help_.release(static_cast<std::ptrdiff_t>(helpers));
  share_samples();
  for (std::size_t busy = busy_; busy != 0; busy = busy_) busy_.wait(busy);
  rays_ = caster_->rays_cast();
}

}  // namespace doppel
