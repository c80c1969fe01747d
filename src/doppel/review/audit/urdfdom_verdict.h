#pragma once
// The result of ROS's parser for a description: that of `check_urdf` of urdfdom 3.0.1, the version of Debian
// 12 and Ubuntu 22.04 and later, with its messages. It is lenient in some cases: a link that it cannot read
// remains as a frame. Source: urdfdom 3.0.1, urdf_parser/src; urdfdom_headers 1.0.6, model.h.

#include <string>
#include <vector>

#include "doppel/base/xml/xml.h"
#include "doppel/export.h"

namespace doppel {

struct UrdfdomVerdict {
  bool ok = false;
  std::vector<std::string> messages;  // its errors and warnings, in its order
};

// `root`: the expanded tree.
DOPPEL_API UrdfdomVerdict urdfdom_verdict(const XmlNode& root);

}  // namespace doppel
