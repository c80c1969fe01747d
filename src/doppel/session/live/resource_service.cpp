#include "doppel/session/live/resource_service.h"

#include <fmt/format.h>

#include "doppel/base/core/fnv_hash.h"
#include "doppel/base/packages/service_uri.h"
#include "doppel/ros/messages/distro.h"
#include "doppel/ros/messages/resource_retriever_interfaces.h"
#include "doppel/ros/messages/rviz_resource_interfaces.h"
#include "doppel/twin/loop/state_publisher.h"

namespace doppel {
namespace {

constexpr DistroRange kAskedByRviz{Distro::kilted, Distro::kilted};

template <class Response>
Response response_of(const AssetLibrary::Answer& answer, const std::string& uri, const std::string& etag) {
  Response out;
  out.expanded_path = uri;
  if (answer.bytes == nullptr) {
    out.status_code = Response::ERROR;
    out.error_reason = answer.why;
    return out;
  }
  out.etag = fmt::format("{:016x}", fnv_hash(std::span(*answer.bytes)));
  out.status_code = out.etag == etag ? Response::NOT_MODIFIED : Response::OK;
  if (out.status_code == Response::OK) {
    const auto* const bytes = reinterpret_cast<const std::uint8_t*>(answer.bytes->data());
    out.body.assign(bytes, bytes + answer.bytes->size());
  }
  return out;
}

}  // namespace

ResourceService::ResourceService(Bus& bus, std::shared_ptr<AssetLibrary> assets)
    : bus_(bus), node_(bus, "/doppel"), reader_(std::move(assets)) {
  if (kAskedByRviz.contains(ros_distro()))
    offer<rviz_resource_interfaces::srv::GetResource>("/rviz/get_resource");
  if (kHaveResourceService.contains(ros_distro()))
    offer<resource_retriever_interfaces::srv::GetResource>(kResourceService);
}

template <class Srv>
void ResourceService::offer(std::string_view service) {
  node_.serve_encoded<Srv>(service, [this](const auto& request, const EncodedResponder& respond) {
    const std::string uri = uri_of_service_path(request.path);
    reader_.fetch(uri, [&bus = bus_, uri, etag = request.etag, respond](const AssetLibrary::Answer& answer) {
      const auto response = std::make_shared<Bytes>(
          to_cdr(response_of<typename Srv::Response>(answer, uri, std::string(etag))));
      bus.post([respond, response] { respond(std::move(*response)); });
    });
  });
}

}  // namespace doppel
