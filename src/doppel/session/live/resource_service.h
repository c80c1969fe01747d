#pragma once
// The files that a robot's description refers to, for RViz on a machine that does not have them: services of
// the same files as the page's (ros/server/asset_library.h). RViz of Kilted calls /rviz/get_resource with any
// URI; that of Lyrical calls the service in a URI service://SERVICE:PATH, which robot_description_remote has
// (base/packages/service_uri.h). Source: rviz 15.0, resource_retriever_service 0.0.3.

#include <memory>
#include <string_view>

#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/server/asset_reader.h"

namespace doppel {

// The loop's thread; files are read and encoded on another one.
class DOPPEL_API ResourceService {
 public:
  ResourceService(Bus& bus, std::shared_ptr<AssetLibrary> assets);

 private:
  template <class Srv>
  void offer(std::string_view service);

  Bus& bus_;
  Node node_;
  AssetReader reader_;
};

}  // namespace doppel
