#pragma once
// URIs of files that another machine asks a service for: service://SERVICE:PATH, as RViz (Lyrical) resolves
// them by resource_retriever_service_plugin. PATH may not contain a colon, thus no scheme either.

#include <string>
#include <string_view>

#include "doppel/export.h"

namespace doppel {

// The XML with the URIs package://... and file://... of its filename attributes as those of the service;
// others stay as they are.
DOPPEL_API std::string with_service_uris(std::string_view xml, std::string_view service);

// The URI of such a path: "my_arm/meshes/base.stl" is package://my_arm/meshes/base.stl, "/tmp/base.stl" a
// file. A URI stays as it is.
DOPPEL_API std::string uri_of_service_path(std::string_view path);

}  // namespace doppel
