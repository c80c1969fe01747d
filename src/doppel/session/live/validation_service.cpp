#include "doppel/session/live/validation_service.h"

#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <utility>

#include "doppel/ros/messages/rcl_interfaces.h"
#include "doppel/ros/messages/std_msgs.h"
#include "doppel/ros/messages/std_srvs.h"
#include "doppel/session/live/detail/background_queue.h"
#include "doppel/session/live/detail/changed_parameters.h"
#include "doppel/session/live/detail/service_refusal.h"

namespace doppel {
namespace {

using doppel_msgs::msg::Validation;
using doppel_msgs::srv::GetValidationReport;
using doppel_msgs::srv::ListChecks;
using doppel_msgs::srv::Validate;
using std_srvs::srv::Trigger;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kProgressPeriod{100}, kResultsPeriod{2000};
constexpr const char* kBusy = "too many requests are waiting: ask again";

}  // namespace

// Used on the loop's thread alone; tasks after its end find it destroyed.
struct ValidationService::LoopPart {
  explicit LoopPart(Bus& bus) : node(bus, "/doppel"), changed(bus) {
    status = node.advertise<Validation>("/doppel/validation", {.depth = 1, .latched = true});
    results =
        node.advertise<std_msgs::msg::String>("/doppel/validation/results", {.depth = 1, .latched = true});
    node.subscribe<rcl_interfaces::msg::ParameterEvent>(
        "/parameter_events",
        [this](const rcl_interfaces::msg::ParameterEvent& event) { changed.keep(event); },
        Qos::parameter_events());
  }

  Node node;
  Publisher<Validation> status;
  Publisher<std_msgs::msg::String> results;
  ChangedParameters changed;
  bool running = false;
};

// Shared with the threads of the suite.
struct ValidationService::Shared {
  Shared(Bus& the_bus, std::weak_ptr<LoopPart> the_loop, LoadValidation the_loader)
      : bus(the_bus), loop(std::move(the_loop)), load(std::move(the_loader)) {}

  // Any thread: the task runs on the loop's thread unless the service has ended.
  void on_loop(std::function<void(LoopPart&)> task) {
    const std::lock_guard lock(mutex);
    if (ending) return;
    bus.post([weak = loop, task = std::move(task)] {
      if (const auto open = weak.lock()) task(*open);
    });
  }

  template <class Response>
  void reply(const Responder<Response>& respond, Response response) {
    on_loop([respond, response = std::move(response)](LoopPart&) { respond(response); });
  }

  [[nodiscard]] std::shared_ptr<ValidationWork> loaded() {
    const std::lock_guard lock(loading);
    if (work == nullptr) work = load();
    return work;
  }

  [[nodiscard]] bool is_cancelled() const { return cancelled || ending; }

  // -- the thread of the run

  void start(const ValidationRequest& request, const std::string& name_space,
             const Responder<Validate::Response>& respond) {
    try {
      loaded()->check_words(request.call);
    } catch (...) {
      on_loop([respond, answer = refusal<Validate::Response>(text_of_exception())](LoopPart& part) {
        part.running = false;
        respond(answer);
      });
      return;
    }
    Validate::Response answer;
    answer.success = true;
    answer.run = ++runs;
    reply(respond, std::move(answer));
    run(request, name_space);
  }

  void run(const ValidationRequest& request, const std::string& name_space) {
    status = {};
    status.state = Validation::RUNNING;
    status.run = runs;
    status.robot = name_space;
    status.effort = request.call.effort.empty() ? "standard" : request.call.effort;
    status.only = request.call.only;
    status.joint = request.call.joint;
    publish_status();
    publish_results("");
    try {
      status.message = work->run(request, watcher());
      status.state = is_cancelled() ? Validation::CANCELLED : Validation::FINISHED;
      if (!is_cancelled()) status.done = 1;
    } catch (...) {
      status.message = text_of_exception();
      status.state = Validation::FAILED;
    }
    publish_results(work->results());
    publish_status();  // with the end of the run, so that who reads it can start the next one
  }

  ValidationWatcher watcher() {
    ValidationWatcher out;
    out.begins = [this](std::vector<std::string> judged) {
      status.judged.assign(judged.begin(), judged.end());
      publish_status();
    };
    // From several threads, one at a time.
    out.progress = [this](double done, const std::string& check) {
      status.done = done;
      status.check = check;
      if (Clock::now() - last_status > kProgressPeriod) publish_status();
      return !is_cancelled();
    };
    out.on_outcome = [this](const doppel_msgs::msg::CheckOutcome& outcome) {
      status.outcomes.push_back(outcome);
      if (Clock::now() - last_results > kResultsPeriod) publish_results(work->results());
      publish_status();
    };
    return out;
  }

  void publish_status() {
    last_status = Clock::now();
    const auto bytes = std::make_shared<const Bytes>(to_cdr(status));
    on_loop([bytes, running = status.state == Validation::RUNNING](LoopPart& part) {
      part.running = running;
      part.status.publish_encoded(bytes, part.node.bus().now());
    });
  }

  void publish_results(std::string text) {
    last_results = Clock::now();
    std_msgs::msg::String message;
    message.data = std::move(text);
    const auto bytes = std::make_shared<const Bytes>(to_cdr(message));
    on_loop([bytes](LoopPart& part) { part.results.publish_encoded(bytes, part.node.bus().now()); });
  }

  Bus& bus;  // until `ending`
  std::weak_ptr<LoopPart> loop;
  LoadValidation load;
  std::mutex mutex, loading;
  std::atomic<bool> ending{false}, cancelled{false};
  std::shared_ptr<ValidationWork> work;
  std::uint32_t runs = 0;
  Validation status;
  Clock::time_point last_status, last_results;
};

struct ValidationService::Impl {
  Impl(Bus& bus, ValidationServiceOptions the_options)
      : options(std::move(the_options)),
        loop(std::make_shared<LoopPart>(bus)),
        shared(std::make_shared<Shared>(bus, loop, options.load)) {
    Node& node = loop->node;
    node.serve<Validate>("/doppel/validate", [this](const Validate::Request& call, const auto& respond) {
      start(call, respond);
    });
    node.serve<Trigger>("/doppel/validate/cancel",
                        [this](const Trigger::Request&, const auto& respond) { respond(cancel()); });
    node.serve<ListChecks>("/doppel/validate/checks",
                           [this](const ListChecks::Request&, const auto& respond) { list(respond); });
    node.serve_encoded<GetValidationReport>(
        "/doppel/validate/report", [this](const GetValidationReport::Request& call,
                                          const EncodedResponder& respond) { report(call, respond); });
    Validation none;
    loop->status.publish(none, bus.now());
  }

  ~Impl() {
    const std::lock_guard lock(shared->mutex);
    shared->ending = true;
    loop.reset();
  }

  void start(const Validate::Request& call, const Responder<Validate::Response>& respond) {
    const auto refuse = [&](std::string why) { respond(refusal<Validate::Response>(std::move(why))); };
    if (loop->running)
      return refuse("a validation runs already: wait for its end, or call /doppel/validate/cancel");
    ValidationRequest request;
    std::string name_space;
    try {
      ValidatedRobot robot = options.robot(std::string(call.robot));
      request.parameters = loop->changed.values_of(robot.name_space, robot.controllers);
      request.scenario = std::move(robot.scenario);
      name_space = robot.name_space;
    } catch (const InputError& error) {
      return refuse(refusal_text(error));
    }
    request.call = call;
    shared->cancelled = false;
    loop->running = suite.post(
        [shared = shared, request, name_space, respond] { shared->start(request, name_space, respond); });
    if (!loop->running) refuse(kBusy);
  }

  Trigger::Response cancel() {
    if (!loop->running) return refusal<Trigger::Response>("no validation runs");
    shared->cancelled = true;
    Trigger::Response out;
    out.success = true;
    out.message = "the validation ends";
    return out;
  }

  void list(const Responder<ListChecks::Response>& respond) {
    const auto work = [shared = shared, respond] {
      ListChecks::Response answer;
      try {
        answer = shared->loaded()->checks();
      } catch (...) {
        answer = refusal<ListChecks::Response>(text_of_exception());
      }
      shared->reply(respond, std::move(answer));
    };
    if (!desk.post(work)) respond(refusal<ListChecks::Response>(kBusy));
  }

  void report(const GetValidationReport::Request& call, const EncodedResponder& respond) {
    const auto refuse = [&](std::string why) {
      respond(to_cdr(refusal<GetValidationReport::Response>(std::move(why))));
    };
    if (loop->running) return refuse("a validation runs: its report is there when it has ended");
    const auto work = [shared = shared, call, respond, page = options.page] {
      GetValidationReport::Response answer;
      try {
        answer.text = shared->loaded()->report(std::string(call.format),
                                               call.page.empty() ? page : std::string(call.page));
        answer.success = true;
      } catch (...) {
        answer = refusal<GetValidationReport::Response>(text_of_exception());
      }
      const auto bytes = std::make_shared<Bytes>(to_cdr(answer));
      shared->on_loop([respond, bytes](LoopPart&) { respond(std::move(*bytes)); });
    };
    if (!desk.post(work)) refuse(kBusy);
  }

  ValidationServiceOptions options;
  std::shared_ptr<LoopPart> loop;
  std::shared_ptr<Shared> shared;
  BackgroundQueue suite, desk;  // the runs; lists and reports
};

ValidationService::ValidationService(Bus& bus, ValidationServiceOptions options)
    : impl_(std::make_unique<Impl>(bus, std::move(options))) {}

ValidationService::~ValidationService() = default;

}  // namespace doppel
