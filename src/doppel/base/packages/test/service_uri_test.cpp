#include "doppel/base/packages/service_uri.h"

#include <gtest/gtest.h>

namespace doppel {
namespace {

TEST(ServiceUri, UrisOfPackagesAndFilesBecomeThoseOfService) {
  EXPECT_EQ(
      with_service_uris("<mesh filename=\"package://arm/meshes/a b.stl\"/><mesh scale='1 1 1' filename "
                        "= 'file:///tmp/x.dae'/>",
                        "/resource_provider"),
      "<mesh filename=\"service:///resource_provider:arm/meshes/a b.stl\"/><mesh scale='1 1 1' filename "
      "= 'service:///resource_provider:/tmp/x.dae'/>");
}

TEST(ServiceUri, OtherUrisStay) {
  for (const char* xml :
       {"<mesh filename=\"meshes/a.stl\"/>", "<mesh filename=\"http://host/a.stl\"/>",
        "<mesh filename=\"package:///a.stl\"/>", "<mesh filename=\"package://arm/a:b.stl\"/>",
        "<mesh filename=\"\"/>", "<a filename/>", "filename=", "filename=\"package://arm/a.stl", ""})
    EXPECT_EQ(with_service_uris(xml, "/s"), xml);
}

TEST(ServiceUri, PathIsThatOfPackageOrFile) {
  EXPECT_EQ(uri_of_service_path("arm/meshes/a.stl"), "package://arm/meshes/a.stl");
  EXPECT_EQ(uri_of_service_path("/tmp/a.stl"), "file:///tmp/a.stl");
  EXPECT_EQ(uri_of_service_path("package://arm/a.stl"), "package://arm/a.stl");
}

}  // namespace
}  // namespace doppel
