#include "doppel/base/core/plugin_module.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace doppel {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::string failure_of(const std::string& module, const char* symbol) {
  try {
    (void)plugin_symbol(module, symbol);
  } catch (const MissingModule& missing) {
    return missing.what();
  }
  return "";
}

TEST(PluginModule, ModuleLeftOutNamesPackageAndOption) {
  EXPECT_THAT(failure_of("doppel_embree_missing", "f"),
              AllOf(HasSubstr("without the module doppel_embree_missing"),
                    HasSubstr("install libembree-dev, configure with -DDOPPEL_WITH_EMBREE=ON")));
}

TEST(PluginModule, UnknownModuleIsNamedByItsPath) {
  EXPECT_THAT(failure_of("doppel_missing", "f"), HasSubstr("libdoppel_missing.so is missing"));
}

TEST(PluginModule, MissingSymbolIsNamedWithItsModule) {
  EXPECT_THAT(failure_of("doppel_image_codecs", "no_such_symbol"),
              AllOf(HasSubstr("doppel_image_codecs cannot be used"), HasSubstr("no_such_symbol")));
}

}  // namespace
}  // namespace doppel
