// A twin with clients that connect and disconnect, on loopback: twenty nodes with four subscriptions each,
// one of which is killed each second without a goodbye and replaced; every ten seconds five new processes
// that call a service 1,000 times together, and five seconds later five that call the same service of a peer
// that answers each request immediately. Once a minute it prints the memory of the twin's process, the latest
// answers and the number of calls without an answer; at the end 40 clients call one service at once, of the
// twin and of the peer:
//   build/bin/bench_ros_soak [minutes, else 60]
// The nodes have the lowest priority: together they require more than one core, and lateness for lack of a
// core is no measure of the twin.
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <sstream>
#include <string_view>

#include "doppel/ros/messages/controller_manager_msgs.h"
#include "doppel/ros/network/bridge_types.h"
#include "doppel/ros/network/service.h"
#include "ros_peers.h"

namespace {

using namespace doppel;
using controller_manager_msgs::srv::ListControllers;
using std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr std::size_t kNodes = 20, kCallers = 5, kCallsOfCaller = 200;
constexpr std::size_t kCrowd = 8, kClientsOfCrowd = 5, kCallsInCrowd = 200;
constexpr auto kReplacement = 1s;  // period of killing a node
constexpr auto kBurst = 10s;
constexpr auto kLost = 5s;     // longer than any repair of lost data takes
constexpr double kLate = 100;  // ms
constexpr const char* kTwinService = "/controller_manager/list_controllers";
constexpr const char* kPeerService = "/bench_peer/list_controllers";

// The results of a number of calls; times in ms.
struct Calls {
  std::size_t answered = 0, lost = 0, late = 0;
  double worst = 0;
  void add(double took) {
    ++answered;
    late += took > kLate ? 1 : 0;
    worst = std::max(worst, took);
  }
  void add(const Calls& other) {
    answered += other.answered;
    lost += other.lost;
    late += other.late;
    worst = std::max(worst, other.worst);
  }
};

// As a caller prints it.
Calls read_calls(const std::string& text) {
  Calls calls;
  std::istringstream in(text);
  if (!(in >> calls.answered >> calls.lost >> calls.late >> calls.worst))
    throw std::runtime_error("a caller ended without a result");
  return calls;
}

// Like those of rmw_fastrtps.
ros2::EndpointSpec endpoint(ros2::NameKind kind, const char* service) {
  const char* const part = kind == ros2::NameKind::request ? "_Request" : "_Response";
  return {ros2::dds_name(kind, service), ros2::dds_type(service_support<ListControllers>().name + part), "",
          ros2::services_qos()};
}

// Calls again as soon as it has its answer.
class Caller {
 public:
  Caller(ros2::Participant& participant, const char* name, std::size_t calls)
      : requests_(participant.make_writer(endpoint(ros2::NameKind::request, name))),
        replies_(participant.make_reader(endpoint(ros2::NameKind::reply, name))),
        left_(calls) {}
  [[nodiscard]] bool is_ready() const { return requests_->matched() == 1 && replies_->matched() == 1; }
  [[nodiscard]] bool is_done() const { return left_ == 0 && !waited_for_; }

  void turn(ros2::Sample& reply, Calls& calls) {
    const auto now = steady_clock::now();
    while (replies_->take(reply)) {
      if (reply.related.writer != replies_->gid() || waited_for_ != reply.related.sequence) continue;
      calls.add(std::chrono::duration<double, std::milli>(now - sent_).count());
      waited_for_.reset();
    }
    if (waited_for_ && now - sent_ > kLost) {
      ++calls.lost;
      waited_for_.reset();
    }
    if (waited_for_ || left_ == 0) return;
    --left_;
    sent_ = now;
    const ros2::SampleIdentity answer_to{replies_->gid(), 0};
    const auto sent = requests_->write(request_, &answer_to);
    if (sent)
      waited_for_ = sent->sequence;
    else
      ++calls.lost;
  }

 private:
  std::unique_ptr<ros2::Writer> requests_;
  std::unique_ptr<ros2::Reader> replies_;
  std::size_t left_;
  const Bytes request_ = to_cdr(ListControllers::Request{});
  std::optional<std::int64_t> waited_for_;
  steady_clock::time_point sent_{};
};

// -- the peers' roles

int call(const char* name, std::size_t clients, std::size_t calls_of_each) {
  bench::end_with_parent();
  bench::Bell bell;
  const auto participant = ros2::make_participant(bench::own_domain(), [&bell] { bell.ring(); });
  std::deque<Caller> callers;
  for (std::size_t i = 0; i < clients; ++i) callers.emplace_back(*participant, name, calls_of_each);
  while (!std::ranges::all_of(callers, &Caller::is_ready)) bell.wait(20ms);
  Calls calls;
  ros2::Sample reply;
  while (!std::ranges::all_of(callers, &Caller::is_done)) {
    for (Caller& caller : callers) caller.turn(reply, calls);
    bell.wait(20ms);
  }
  fmt::print("{} {} {} {:.3f}\n", calls.answered, calls.lost, calls.late, calls.worst);
  return 0;
}

// The endpoints of an rclcpp node: the standard ones and four subscriptions, read fifty times a second.
int subscribe() {
  bench::end_with_parent();
  setpriority(PRIO_PROCESS, 0, 19);
  const auto participant = ros2::make_participant(bench::own_domain(), [] {});
  const std::string node = fmt::format("/soak_{}", getpid());
  std::deque<ros2::ServiceServer> services;
  for (const char* name : {"DescribeParameters", "GetParameterTypes", "GetParameters", "ListParameters",
                           "SetParameters", "SetParametersAtomically"})
    services.emplace_back(*participant, ros2::service_spec(fmt::format("{}/{}", node, name),
                                                           fmt::format("rcl_interfaces/srv/{}", name)));
  const auto events =
      participant->make_writer(bench::topic("/parameter_events", "rcl_interfaces/msg/ParameterEvent"));
  const auto log = participant->make_writer(bench::topic("/rosout", "rcl_interfaces/msg/Log"));
  std::deque<std::unique_ptr<ros2::Reader>> subscriptions;
  for (const auto& [name, type] : {std::pair("/joint_states", "sensor_msgs/msg/JointState"),
                                   std::pair("/dynamic_joint_states", "control_msgs/msg/DynamicJointState"),
                                   std::pair("/omarm_arm_controller/controller_state",
                                             "control_msgs/msg/JointTrajectoryControllerState"),
                                   std::pair("/tf", "tf2_msgs/msg/TFMessage")})
    subscriptions.push_back(participant->make_reader(bench::topic(name, type)));
  ros2::Sample sample;
  while (true) {
    for (const auto& subscription : subscriptions)
      while (subscription->take(sample)) continue;
    std::this_thread::sleep_for(20ms);
  }
}

// Answers each request immediately with a response of the twin, as a server of rmw_fastrtps does.
int serve() {
  bench::end_with_parent();
  bench::Bell bell;
  const auto participant = ros2::make_participant(bench::own_domain(), [&bell] { bell.ring(); });
  Bytes answer;
  {
    ros2::ServiceClient twin(*participant,
                             ros2::service_spec(kTwinService, service_support<ListControllers>().name));
    while (!twin.is_available()) bell.wait(20ms);
    twin.send(to_cdr(ListControllers::Request{}));
    ros2::Sample reply;
    while (!twin.take(reply)) bell.wait(20ms);
    answer = reply.cdr;
  }
  const auto requests = participant->make_reader(endpoint(ros2::NameKind::request, kPeerService));
  const auto replies = participant->make_writer(endpoint(ros2::NameKind::reply, kPeerService));
  ros2::Sample request;
  while (true) {
    while (requests->take(request)) {
      const ros2::SampleIdentity to{request.related.writer, request.identity.sequence};
      const auto until = steady_clock::now() + 100ms;
      while (!replies->is_matched(to.writer) && steady_clock::now() < until) std::this_thread::sleep_for(1ms);
      replies->write(answer, &to);
    }
    bell.wait(20ms);
  }
}

// -- the soak

// The resident memory of the process, MB.
double memory_of(pid_t process) {
  std::ifstream status(fmt::format("/proc/{}/status", process));
  for (std::string word; status >> word;) {
    if (word != "VmRSS:") continue;
    double kilobytes = 0;
    status >> kilobytes;
    return kilobytes / 1024;
  }
  throw std::runtime_error("the twin has ended");
}

using Peers = std::deque<std::unique_ptr<bench::Peer>>;

Peers start(const char* role, std::size_t count) {
  Peers peers;
  for (std::size_t i = 0; i < count; ++i) peers.push_back(std::make_unique<bench::Peer>(role));
  return peers;
}

Calls results_of(const Peers& peers) {
  Calls calls;
  for (const auto& peer : peers) calls.add(read_calls(peer->output()));
  return calls;
}

void print_calls(std::string_view what, const Calls& calls) {
  fmt::print("    {:<12} {:6} calls  {:4} lost  {:4} later than {:g} ms  latest {:7.1f} ms\n", what,
             calls.answered + calls.lost, calls.lost, calls.late, kLate, calls.worst);
  std::fflush(stdout);
}

// Of the twin, and of the peer.
struct Answers {
  Calls twin, peer;
  void add(const Answers& other) {
    twin.add(other.twin);
    peer.add(other.peer);
  }
  void print() const {
    print_calls("of the twin", twin);
    print_calls("of the peer", peer);
  }
};

// Replaces nodes and makes calls; returns the twin's memory at the end of each minute.
std::vector<double> soak(pid_t twin, int minutes, Answers& all) {
  Peers nodes;
  for (std::size_t i = 0; i < kNodes; ++i) {
    nodes.push_back(std::make_unique<bench::Peer>("--subscribe"));
    std::this_thread::sleep_for(kReplacement / 2);
  }
  std::vector<double> memory;
  auto second = steady_clock::now();
  for (int minute = 1; minute <= minutes; ++minute) {
    Answers answers;
    Peers of_twin, of_peer;
    for (auto at = 0s; at < 60s; at += kReplacement) {
      if (at % kBurst == 0s) {
        answers.peer.add(results_of(std::exchange(of_peer, {})));
        of_twin = start("--call", kCallers);
      }
      if (at % kBurst == kBurst / 2) {
        answers.twin.add(results_of(std::exchange(of_twin, {})));
        of_peer = start("--call-peer", kCallers);
      }
      nodes.front()->end(SIGKILL);
      nodes.pop_front();
      nodes.push_back(std::make_unique<bench::Peer>("--subscribe"));
      std::this_thread::sleep_until(second += kReplacement);
    }
    answers.peer.add(results_of(of_peer));
    memory.push_back(memory_of(twin));
    fmt::print("  minute {:3}: {:.1f} MB\n", minute, memory.back());
    answers.print();
    all.add(answers);
  }
  return memory;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view role = argc > 1 ? argv[1] : "";
  if (role == "--subscribe") return subscribe();
  if (role == "--serve") return serve();
  if (role == "--call") return call(kTwinService, 1, kCallsOfCaller);
  if (role == "--call-peer") return call(kPeerService, 1, kCallsOfCaller);
  if (role == "--crowd") return call(kTwinService, kClientsOfCrowd, kCallsInCrowd);
  if (role == "--crowd-of-peer") return call(kPeerService, kClientsOfCrowd, kCallsInCrowd);
  const int minutes = argc > 1 ? std::max(1, std::atoi(argv[1])) : 60;
  const auto program = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "doppel";
  bench::Peer twin({program, "up", std::filesystem::path(DOPPEL_ROBOTS) / "omarm_one", "--headless",
                    "--no-reload", "--domain", std::to_string(bench::own_domain().domain)});
  const bench::Peer peer("--serve");
  fmt::print(
      "omarm_one among {} nodes with 4 subscriptions, one killed each second, and {} calls each {} s\n",
      kNodes, kCallers * kCallsOfCaller, kBurst.count());
  Answers all;
  const std::vector<double> memory = soak(twin.pid(), minutes, all);
  const std::size_t settled = std::min<std::size_t>(4, memory.size() - 1);
  fmt::print("  in total: memory from minute {} on {:+.1f} MB, {:.1f} MB at most\n", settled + 1,
             memory.back() - memory[settled], *std::max_element(memory.begin(), memory.end()));
  all.print();
  fmt::print("{} clients of one service at once, {} calls each\n", kCrowd * kClientsOfCrowd, kCallsInCrowd);
  print_calls("of the twin", results_of(start("--crowd", kCrowd)));
  print_calls("of the peer", results_of(start("--crowd-of-peer", kCrowd)));
}
