#include <fmt/format.h>

#include <algorithm>

#include "doppel/ros/server/hub.h"

// fetchAsset: one file at a time for each client, the next one when the former is written, so that a client
// that requests all files and reads none occupies no more memory than that.

namespace doppel {
namespace {

constexpr std::size_t kMaxUri = 4096;  // bytes, as a path of Linux

}  // namespace

void Hub::handle(Client& client, ClientId id, const foxglove::FetchAsset& fetch) {
  const auto fail = [&](std::string why) {
    client.link->send(make_frame(foxglove::to_frame(foxglove::AssetFailure{fetch.request, std::move(why)})));
  };
  if (!assets_.offers()) return fail("this server has no files");
  if (fetch.uri.size() > kMaxUri) return fail(fmt::format("a URI has at most {} bytes", kMaxUri));
  if (client.fetches.size() >= options_.max_fetches)
    return fail(fmt::format("the maximum of {} pending file requests is reached", options_.max_fetches));
  client.fetches.push_back(fetch);
  fetch_next(client, id);
}

void Hub::fetch_next(Client& client, ClientId id) {
  if (client.fetching || client.fetches.empty() || client.link->unsent_assets() > 0) return;
  client.fetching = true;
  assets_.fetch(client.fetches.front().uri, [this, id, request = client.fetches.front().request](
                                                AssetLibrary::Answer answer) {
    post_([this, id, request, answer = std::move(answer)] { finish_fetch(id, request, answer); });
  });
  client.fetches.pop_front();
}

void Hub::finish_fetch(ClientId id, std::uint32_t request, const AssetLibrary::Answer& answer) {
  const auto found = clients_.find(id);
  if (found == clients_.end()) return;
  Client& client = found->second;
  client.fetching = false;
  if (answer.bytes == nullptr) {
    client.link->send(make_frame(foxglove::to_frame(foxglove::AssetFailure{request, answer.why})));
  } else {
    OutgoingFrame frame{.kind = OutgoingFrame::Kind::asset, .owner = answer.bytes, .body = *answer.bytes};
    const auto head = foxglove::asset_head(request);
    std::ranges::copy(head, frame.head.begin());
    frame.head_size = head.size();
    client.link->send(std::move(frame));
  }
  fetch_next(client, id);
}

void Hub::has_room(ClientId id) {
  const auto found = clients_.find(id);
  if (found != clients_.end()) fetch_next(found->second, id);
}

}  // namespace doppel
