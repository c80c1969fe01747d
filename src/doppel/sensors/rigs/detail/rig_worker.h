#pragma once
// The thread that makes the samples of a rig, in order. The loop hands over jobs from a fixed number of slots and takes
// them back when they are done, without locking: the slots are a ring between the two. With more than one thread, the
// samples of a job are divided among them; what they contain does not depend on it.

#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <semaphore>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/sensors/render/ray_caster.h"
#include "doppel/sensors/rigs/detail/light_sensor.h"
#include "doppel/sensors/rigs/detail/object_labels.h"
#include "doppel/sensors/rigs/detail/world_scene.h"

namespace doppel {

// All samples of one step.
struct RigJob {
  Time now{}, stamp{};                         // simulated; of the headers
  std::shared_ptr<const CompiledWorld> world;  // of which the poses are
  std::vector<Pose> poses;
  std::vector<LightSample> samples;
  // Written by the worker: the messages of each sample, its cost in s, and why it failed.
  std::vector<std::vector<LightMessage>> messages;
  std::vector<double> costs;
  std::vector<std::string> failures;  // empty: it did not
  Diagnostics reports;                // for the log, which belongs to the loop
};

class RigWorker {
 public:
  static constexpr std::size_t kSlots = 3;

  using MakeScene = std::function<std::shared_ptr<const RenderScene>(const CompiledWorld&, Diagnostics&)>;

  // `sensors` by the index of LightSample; unchanged while there are jobs.
  // Throws std::system_error if a thread cannot be started.
  RigWorker(const std::vector<std::shared_ptr<LightSensor>>& sensors, int threads,
            MakeScene make_scene = make_world_scene);
  ~RigWorker();
  RigWorker(const RigWorker&) = delete;
  RigWorker& operator=(const RigWorker&) = delete;

  // Memory for jobs of this size, so that the loop allocates none: of the free slots now, of the others when
  // they are released. Between steps.
  void reserve(std::size_t samples, std::size_t bodies);

  // -- the loop
  // A free slot, or nullptr: the worker is behind. Then submit().
  RigJob* free_slot();
  void submit();
  // The oldest job that is done, or nullptr. Then release().
  RigJob* done();
  void release();
  [[nodiscard]] bool idle() const { return submitted_ == finished_.load(std::memory_order_acquire); }
  void wait_idle() const;
  [[nodiscard]] std::uint64_t rays_cast() const { return rays_.load(std::memory_order_relaxed); }

 private:
  void make_room(RigJob& job) const;
  void run();
  void finish();  // joins the threads that have been started
  void work_on(RigJob& job);
  void make(RigJob& job);
  void make_sample(RigJob& job, std::size_t index);
  // A sensor without memory or Embree must not end the run: its failure is reported, once until it fails for another reason.
  void report_failures(RigJob& job);
  void report(RigJob& job, const SourceLocation& where, const std::string& text);
  // Makes samples of the present job until none is left.
  void share_samples();
  // The exception that is being handled is why a sample of the present job has no messages.
  void note_failure(std::size_t index) noexcept;
  void assist();
  // Throws where the scene of the job's world fails; that is tried once for each world.
  void renew_scene(RigJob& job);

  const std::vector<std::shared_ptr<LightSensor>>& sensors_;
  const MakeScene make_scene_;
  std::array<RigJob, kSlots> slots_;
  // Numbers of jobs so far; a job is in the slot of its number modulo kSlots.
  std::size_t submitted_ = 0, released_ = 0;      // the loop's
  std::size_t max_samples_ = 0, max_bodies_ = 0;  // of a job; the loop's
  std::atomic<std::size_t> finished_{0};
  std::counting_semaphore<kSlots + 1> work_{0};
  std::atomic<bool> ends_{false};
  std::atomic<std::uint64_t> rays_{0};

  // The worker's.
  std::shared_ptr<const CompiledWorld> scene_of_;
  std::string scene_failure_;  // empty: it did not
  std::unique_ptr<RayCaster> caster_;
  std::unique_ptr<const ObjectLabels> objects_;
  std::set<std::string> reported_;
  RigJob* job_ = nullptr;  // whose samples are divided
  std::atomic<std::size_t> next_sample_{0}, busy_{0};
  std::counting_semaphore<> help_{0};
  std::atomic<bool> assistants_end_{false};
  std::vector<std::thread> assistants_;
  std::thread thread_;  // last: it uses the members above
};

}  // namespace doppel
