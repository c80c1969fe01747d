// Client of Python: a twin or a ROS 2 graph in another process. Messages are JSON; python/doppel/_client.py
// has the interface.
#include <fmt/format.h>
#include <pybind11/stl.h>

#include <cstdint>
#include <cstdlib>
#include <mutex>

#include "doppel/ros/client/graph_client.h"
#include "doppel/ros/client/websocket_client.h"
#include "doppel/ros/server/announcement.h"
#include "python/conversions.h"
#include "python/process_owned.h"
#include "python/tools_bindings.h"

namespace doppel::python {
namespace {

using Clock = std::chrono::steady_clock;
using Unlocked = py::call_guard<py::gil_scoped_release>;

Clock::time_point after(double seconds) {
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

// Ctrl-C during a wait, which has released the interpreter's lock. The exception stays set until the wait
// ends.
bool interrupted() {
  const py::gil_scoped_acquire locked;
  return PyErr_CheckSignals() != 0;
}

std::unique_ptr<Client> join_graph() {
  ros2::GraphClientOptions options;
  Diagnostics diagnostics;
  options.network = ros2::from_environment([](const char* name) { return std::getenv(name); }, diagnostics);
  options.interrupted = interrupted;
  return std::make_unique<ros2::GraphClient>(std::move(options));
}

std::unique_ptr<Client> join_twin(const std::string& host, int port, const std::string& token) {
  ClientOptions options;
  options.interrupted = interrupted;
  options.host = host;
  options.token = token;
  options.port = static_cast<std::uint16_t>(port);
  if (port == 0) {
    std::vector<RunningTwin> twins = find_running();
    std::erase_if(twins, &RunningTwin::emulated);  // its driver commands it
    if (twins.empty())
      throw InputError("client.no_twin", {}, "no twin is running on this machine",
                       "start one with 'doppel up', or pass port= or ros=True");
    options.host = twins.front().address;
    options.port = twins.front().port;
    options.token = twins.front().token;
  }
  return std::make_unique<WebSocketClient>(std::move(options));
}

// The functions lock it, because a Client is for one thread. In a fork of the process all but unsubscribe(),
// which has no effect there, throw InputError "python.forked".
class GraphAccess {
 public:
  GraphAccess(const std::string& host, int port, const std::string& token, bool ros)
      : client_(ros ? join_graph() : join_twin(host, port, token)) {}

  template <class List>
  static std::map<std::string, std::string> types_of(const List& list) {
    std::map<std::string, std::string> out;
    for (const auto& [name, one] : list) out[name] = one.type;
    return out;
  }
  std::map<std::string, std::string> topics() {
    const auto lock = hold();
    return types_of(client_->topics());
  }
  std::map<std::string, std::string> services() {
    const auto lock = hold();
    return types_of(client_->services());
  }
  std::vector<std::string> nodes() {
    const auto lock = hold();
    return client_->nodes();
  }

  void publish(const std::string& topic, const std::string& type, const std::string& json) {
    const auto lock = hold();
    const TypeSupport& support = type.empty() ? client_->message_type(topic) : type_named(type);
    client_->publish(topic, support.name, encode(support, json, topic));
    client_->sync();
  }
  void subscribe(const std::string& topic) {
    const auto lock = hold();
    client_->subscribe(topic);
  }
  void unsubscribe(const std::string& topic) {
    if (!process_.is_this_one()) return;
    const auto lock = hold();
    client_->unsubscribe(topic);
  }
  // The next message of any subscribed topic: (topic, JSON).
  std::optional<std::pair<std::string, std::string>> next(double seconds) {
    const auto lock = hold();
    Client::Received received;
    if (!client_->next(received, after(seconds))) return std::nullopt;
    std::string json;
    if (const Status read = client_->message_type(received.topic).cdr_to_json(received.cdr, json); !read)
      throw ClientError(fmt::format("{}: {}", received.topic, read.why()));
    return std::pair(received.topic, json);
  }

  std::string call(const std::string& service, const std::string& json, double seconds) {
    const auto lock = hold();
    const std::string& type = client_->find_service(service).type;
    const ServiceSupport* const support = find_service(type);
    if (support == nullptr) throw ClientError(fmt::format("the type {} of {} is not known", type, service));
    const Client::Answer answer =
        client_->call(service, encode(*support->request, json, service),
                      std::chrono::milliseconds(static_cast<std::int64_t>(seconds * 1e3)));
    if (!answer.ok) throw ClientError(fmt::format("{}: {}", service, answer.why));
    std::string out;
    if (const Status read = support->response->cdr_to_json(answer.response, out); !read)
      throw ClientError(fmt::format("{}: {}", service, read.why()));
    return out;
  }

  std::vector<NamedParameter> parameters(const std::string& node) {
    const auto lock = hold();
    return node.empty() ? client_->parameters() : client_->parameters(node);
  }
  void set_parameter(const std::string& node, const std::string& name, const ParameterValue& value) {
    const auto lock = hold();
    if (const Status set = client_->set_parameter(node, name, value); !set)
      throw InputError("python.parameter", {}, fmt::format("{} of {}: {}", name, node, set.why()));
  }

 private:
  [[nodiscard]] std::unique_lock<std::mutex> hold() {
    process_.check("the client");
    return std::unique_lock(mutex_);
  }
  static const TypeSupport& type_named(const std::string& name) {
    const TypeSupport* const found = find_type(name);
    if (found == nullptr)
      throw InputError("python.type", {}, fmt::format("'{}' is no type of messages", name),
                       "write for example std_msgs/msg/Float64");
    return *found;
  }
  static Bytes encode(const TypeSupport& type, const std::string& json, const std::string& subject) {
    Bytes out;
    if (const Status encoded = type.json_to_cdr(json, out); !encoded)
      throw InputError("python.message", {}, fmt::format("{}: {}", subject, encoded.why()),
                       fmt::format("the fields are those of {}", type.name));
    return out;
  }

  OwningProcess process_;
  std::mutex mutex_;
  ProcessOwned<Client> client_;
};

py::dict parameters(GraphAccess& self, const std::string& node) {
  std::vector<NamedParameter> list;
  {
    const py::gil_scoped_release released;
    list = self.parameters(node);
  }
  py::dict out;
  for (const NamedParameter& parameter : list) {
    const py::str owner(parameter.node);
    if (!out.contains(owner)) out[owner] = py::dict();
    out[owner][py::str(parameter.name)] = py::cast(parameter.value);
  }
  return out;
}

}  // namespace

void bind_client(py::module_& module) {
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const ClientError& error) {
      const py::object type = py::module_::import("doppel._errors").attr("ServiceError");
      PyErr_SetString(type.ptr(), error.what());
    } catch (const Interrupted&) {
      if (PyErr_Occurred() == nullptr) PyErr_SetNone(PyExc_KeyboardInterrupt);
    }
  });
  py::class_<GraphAccess>(module, "GraphAccess")
      .def(py::init<const std::string&, int, const std::string&, bool>(), Unlocked())
      .def("topics", &GraphAccess::topics, Unlocked())
      .def("services", &GraphAccess::services, Unlocked())
      .def("nodes", &GraphAccess::nodes, Unlocked())
      .def("publish", &GraphAccess::publish, Unlocked())
      .def("subscribe", &GraphAccess::subscribe, Unlocked())
      .def("unsubscribe", &GraphAccess::unsubscribe, Unlocked())
      .def("next", &GraphAccess::next, Unlocked())
      .def("call", &GraphAccess::call, Unlocked())
      .def("parameters", &parameters)
      .def("set_parameter", &GraphAccess::set_parameter, Unlocked());
}

}  // namespace doppel::python
