// GraphClient's services, and the parameters that are read by them.

#include <fmt/format.h>

#include <algorithm>

#include "doppel/ros/bus/parameter_services.h"
#include "doppel/ros/client/detail/graph_client.h"

namespace doppel::ros2 {
namespace {

namespace srv = rcl_interfaces::srv;

double seconds(std::chrono::milliseconds time) {
  return static_cast<double>(time.count()) / 1e3;
}

template <Message M>
M decode(const doppel::Client::Answer& answer, const std::string& service) {
  M message;
  const Status status =
      answer.ok ? from_cdr(std::span(answer.response), message) : Status::refused(answer.why);
  if (!status) throw ClientError("service " + service + ": " + status.why());
  return message;
}

}  // namespace

ServiceClient& GraphClient::Impl::service_client(const std::string& name) {
  if (const auto found = clients.find(name); found != clients.end()) return *found->second;
  const auto& all = graph->services();
  const auto found = std::ranges::find(all, name, &GraphService::name);
  const GraphEndpoint& server = found->servers.front();
  const TypeSupport* response = find_type(server.type + "_Response");
  auto made = std::make_unique<ServiceClient>(
      *participant, ServiceSpec{.name = name,
                                .type = server.type,
                                .request_hash = server.type_hash,
                                .response_hash = response != nullptr ? response->hash() : ""});
  ServiceClient& client = *clients.emplace(name, std::move(made)).first->second;
  announce();
  return client;
}

std::uint32_t GraphClient::Impl::begin_call(const std::string& service, std::span<const std::byte> request) {
  ServiceClient& client = service_client(service);
  const auto available = [&] { return client.is_available(); };
  if (!wait(available, Clock::now() + options.timeout)) {
    throw ClientError(fmt::format("service {} is announced, but no server was matched within {} s", service,
                                  seconds(options.timeout)));
  }
  const auto sequence = client.send(request);
  if (!sequence) throw ClientError("the request to " + service + " could not be sent");
  pending[++calls] = {service, *sequence};
  return calls;
}

void GraphClient::Impl::take_replies() {
  Sample reply;
  for (auto& [name, client] : clients) {
    while (client->take(reply)) {
      const auto asked = std::ranges::find_if(pending, [&, &service = name](const auto& entry) {
        return entry.second.service == service && entry.second.sequence == reply.related.sequence;
      });
      if (asked == pending.end()) continue;  // another server has already responded
      answers[asked->first] = {true, "", reply.cdr};
      pending.erase(asked);
    }
  }
  std::erase_if(pending, [&](const auto& entry) {
    // Not is_available(), which is briefly false while another server is being matched.
    if (clients.at(entry.second.service)->requests().matched() > 0) return false;
    answers[entry.first] = {false, "service " + entry.second.service + " disappeared before it answered", {}};
    return true;
  });
}

doppel::Client::Answer GraphClient::Impl::ask(const std::string& service, const Bytes& request) {
  const std::uint32_t call = begin_call(service, request);
  Answer answer;
  bool taken = false;
  if (!wait([&] { return taken = taken || take(call, answer); }, Clock::now() + options.timeout)) {
    pending.erase(call);
    return {false, fmt::format("it did not answer within {} s", seconds(options.timeout)), {}};
  }
  return answer;
}

std::uint32_t GraphClient::begin_call(const std::string& service, std::span<const std::byte> request) {
  static_cast<void>(find_service(service));
  return impl_->begin_call(service, request);
}

std::vector<NamedParameter> GraphClient::parameters() {
  std::vector<NamedParameter> out;
  for (const std::string& node : nodes()) {
    if (!services().contains(node + "/list_parameters")) continue;
    try {
      for (NamedParameter& parameter : parameters(node)) out.push_back(std::move(parameter));
    } catch (const ClientError& error) {
      impl_->warn(std::string("the parameters of ") + node + " are omitted: " + error.what());
    }
  }
  return out;
}

std::vector<NamedParameter> GraphClient::parameters(const std::string& node) {
  const std::string list = node + "/list_parameters", get = node + "/get_parameters";
  if (!services().contains(list) || !services().contains(get))
    throw ClientError("node " + node + " offers no parameters");
  const auto names =
      decode<srv::ListParameters::Response>(impl_->ask(list, to_cdr(srv::ListParameters::Request())), list)
          .result.names;
  srv::GetParameters::Request request;
  request.names = names;
  const auto values = decode<srv::GetParameters::Response>(impl_->ask(get, to_cdr(request)), get).values;
  std::vector<NamedParameter> out;
  for (std::size_t i = 0; i < std::min(names.size(), values.size()); ++i)
    out.push_back({.node = node, .name = names[i], .value = from_msg(values[i])});
  return out;
}

Status GraphClient::set_parameter(const std::string& node, const std::string& name,
                                  const ParameterValue& value) {
  const std::string set = node + "/set_parameters";
  if (!services().contains(set)) throw ClientError("node " + node + " has no service to set parameters");
  srv::SetParameters::Request request;
  request.parameters.push_back({name, to_msg(value)});
  const auto results = decode<srv::SetParameters::Response>(impl_->ask(set, to_cdr(request)), set).results;
  if (results.empty()) return Status::refused("the node gives no information about it");
  return results.front().successful ? Status() : Status::refused(results.front().reason);
}

}  // namespace doppel::ros2
