#include "doppel/session/live/calibration_service.h"

#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <future>
#include <limits>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "doppel/base/core/shown_path.h"
#include "doppel/review/calibration/resting_position.h"
#include "doppel/ros/messages/std_srvs.h"
#include "doppel/session/live/detail/background_queue.h"
#include "doppel/session/live/detail/calibration_entries.h"
#include "doppel/session/live/detail/calibration_file.h"
#include "doppel/session/live/detail/service_refusal.h"

namespace doppel {
namespace {

using doppel_msgs::msg::Calibration;
using doppel_msgs::srv::ForgetMeasurements;
using doppel_msgs::srv::MeasureJoint;
using doppel_msgs::srv::WriteCalibration;
using std_srvs::srv::Trigger;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kLoopPatience{500};

// The reason of an exception is the answer.
template <class Response>
void refuse_if_thrown(const Responder<Response>& respond, const std::function<void()>& act) {
  try {
    act();
  } catch (const InputError& error) {
    respond(refusal<Response>(refusal_text(error)));
  }
}

}  // namespace

// Used on the loop's thread alone; tasks after its end find it destroyed.
struct CalibrationService::LoopPart {
  LoopPart(Bus& bus, CalibrationServiceOptions the_options)
      : options(std::move(the_options)),
        node(bus, "/doppel"),
        topic(node.advertise<Calibration>("/doppel/calibration", {.depth = 1, .latched = true})) {}

  void publish() {
    Calibration message;
    entries.write(message);
    message.measuring = measuring;
    if (written) {
      message.file = written->file.string();
      message.undo_joints.assign(written->joints.begin(), written->joints.end());
    }
    topic.publish(message, node.bus().now());
  }

  void update() {
    entries.update(options.robots ? options.robots() : std::vector<CalibratedRobot>{});
    publish();
  }

  void refuse_while_busy() const {
    if (!measuring.empty())
      throw InputError("calibrate.busy", {}, fmt::format("'{}' is being measured", measuring));
    if (writing) throw InputError("calibrate.busy", {}, "the overlay is being written");
  }

  CalibrationServiceOptions options;
  Node node;
  Publisher<Calibration> topic;
  CalibrationEntries entries;
  std::string measuring;
  bool writing = false;
  std::optional<WrittenCorrections> written;  // the last ones
};

// Shared with the thread that waits for samples and writes files.
struct CalibrationService::Shared {
  Shared(Bus& the_bus, std::weak_ptr<LoopPart> the_loop) : bus(the_bus), loop(std::move(the_loop)) {}

  // Any thread: the task runs on the loop's thread unless the service has ended.
  void on_loop(std::function<void(LoopPart&)> task) {
    const std::lock_guard lock(mutex);
    if (ending) return;
    bus.post([weak = loop, task = std::move(task)] {
      if (const auto open = weak.lock()) task(*open);
    });
  }

  // NaN: the loop does not answer.
  double sample(const std::string& name_space, const std::string& joint) {
    const auto answer = std::make_shared<std::promise<double>>();
    std::future<double> value = answer->get_future();
    on_loop([answer, name_space, joint](LoopPart& part) {
      answer->set_value(part.options.position(name_space, joint));
    });
    return value.wait_for(kLoopPatience) == std::future_status::ready
               ? value.get()
               : std::numeric_limits<double>::quiet_NaN();
  }

  // Throws InputError: it moves, or nothing is reported.
  double position_at_rest(const std::string& name_space, const std::string& joint) {
    RestingPosition position;
    const auto until = Clock::now() + from_seconds(RestingPosition::kMaxWait);
    while (Clock::now() < until && !ending) {
      if (const auto found = position.take(sample(name_space, joint))) return *found;
      std::this_thread::sleep_for(from_seconds(RestingPosition::kMinBetween));
    }
    throw position.refusal(joint);
  }

  Bus& bus;  // until `ending`
  std::weak_ptr<LoopPart> loop;
  std::mutex mutex;
  std::atomic<bool> ending{false};
};

struct CalibrationService::Impl {
  Impl(Bus& bus, CalibrationServiceOptions options)
      : loop(std::make_shared<LoopPart>(bus, std::move(options))),
        shared(std::make_shared<Shared>(bus, loop)) {
    serve<MeasureJoint>("measure", &Impl::measure);
    serve<ForgetMeasurements>("forget", &Impl::forget);
    serve<WriteCalibration>("write", &Impl::write);
    serve<Trigger>("undo", &Impl::undo);
    loop->update();
  }

  ~Impl() {
    const std::lock_guard lock(shared->mutex);
    shared->ending = true;
    loop.reset();
  }

  template <class Srv>
  void serve(const char* name,
             void (Impl::*act)(const typename Srv::Request&, const Responder<typename Srv::Response>&)) {
    loop->node.serve<Srv>(fmt::format("/doppel/calibrate/{}", name),
                          [this, act](const typename Srv::Request& request, const auto& respond) {
                            refuse_if_thrown<typename Srv::Response>(respond, [&] {
                              loop->refuse_while_busy();
                              (this->*act)(request, respond);
                            });
                          });
  }

  void post(std::function<void()> work) {
    if (!desk.post(std::move(work)))
      throw InputError("calibrate.busy", {}, "too many requests are waiting", "ask again");
  }

  void measure(const MeasureJoint::Request& request, const Responder<MeasureJoint::Response>& respond) {
    const std::string name_space(request.robot), name(request.joint);
    const double model = request.model;
    static_cast<void>(CalibrationEntries::with(loop->entries.find(name_space, name), {model, 0}));
    post([shared = shared, name_space, name, model, respond] {
      MeasureJoint::Response out;
      try {
        out.machine = shared->position_at_rest(name_space, name);
        out.success = true;
      } catch (...) {
        out = refusal<MeasureJoint::Response>(text_of_exception());
      }
      shared->on_loop([name_space, name, model, out, respond](LoopPart& part) {
        part.measuring.clear();
        if (out.success) part.entries.keep(name_space, name, {model, out.machine});
        part.publish();
        respond(out);
      });
    });
    loop->measuring = name;
    loop->publish();
  }

  void forget(const ForgetMeasurements::Request& request,
              const Responder<ForgetMeasurements::Response>& respond) {
    loop->entries.forget(std::string(request.robot), std::string(request.joint));
    loop->publish();
    ForgetMeasurements::Response out;
    out.success = true;
    respond(out);
  }

  void write(const WriteCalibration::Request& request, const Responder<WriteCalibration::Response>& respond) {
    const auto entries = loop->entries.with_results(std::string(request.robot),
                                                    {request.joints.begin(), request.joints.end()});
    std::vector<MeasuredJoint> joints;
    for (const CalibrationEntry* entry : entries) {
      if (!entry->result->operations.empty()) joints.push_back({entry->joint, entry->result->operations});
    }
    if (joints.empty())
      throw InputError("calibrate.nothing", {},
                       "there is nothing to correct: the model is as the machine is");
    post([shared = shared, robot = entries.front()->robot, bundled = loop->options.bundled_robots, joints,
          respond] {
      WriteCalibration::Response out;
      std::optional<WrittenCorrections> written;
      try {
        written = write_corrections(robot, bundled, joints);
        out.success = true;
        out.file = written->file.string();
        out.message = "written to " + shown_path(written->file);
      } catch (...) {
        out = refusal<WriteCalibration::Response>(text_of_exception());
      }
      shared->on_loop([written, out, respond](LoopPart& part) {
        part.writing = false;
        if (written) {
          part.written = written;
          part.entries.note_file(written->name_space, written->joints, true);
        }
        part.publish();
        respond(out);
      });
    });
    loop->writing = true;
  }

  void undo(const Trigger::Request& /*request*/, const Responder<Trigger::Response>& respond) {
    if (!loop->written)
      throw InputError("calibrate.undo", {}, "nothing was written since the start",
                       "doppel overlay show lists the corrections");
    post([shared = shared, written = *loop->written, respond] {
      Trigger::Response out;
      try {
        take_back(written);
        out.success = true;
        out.message = shown_path(written.file) + " is as before";
      } catch (...) {
        out = refusal<Trigger::Response>(text_of_exception());
      }
      shared->on_loop([written, out, respond](LoopPart& part) {
        part.writing = false;
        if (out.success) {
          part.written.reset();
          part.entries.note_file(written.name_space, written.joints, false);
        }
        part.publish();
        respond(out);
      });
    });
    loop->writing = true;
  }

  std::shared_ptr<LoopPart> loop;
  std::shared_ptr<Shared> shared;
  BackgroundQueue desk;
};

CalibrationService::CalibrationService(Bus& bus, CalibrationServiceOptions options)
    : impl_(std::make_unique<Impl>(bus, std::move(options))) {}

CalibrationService::~CalibrationService() = default;

void CalibrationService::update() {
  impl_->loop->update();
}

}  // namespace doppel
