#pragma once
// Gates about the files of a machine: G01 origin, G02 parsing, G03 tree.

#include "doppel/export.h"
#include "doppel/validation/checks/context.h"

namespace doppel {

DOPPEL_API CheckResult check_origin(const CheckContext& context);
DOPPEL_API CheckResult check_parsing(const CheckContext& context);
// Compares the tree with validation/tree.txt, or writes it where there is none.
DOPPEL_API CheckResult check_tree(const CheckContext& context);

// "base_link\n  Revolute 1 (revolute): base_link -> link_1\n": the tree without what calibration changes.
DOPPEL_API std::string plain_tree(const Model& model);

}  // namespace doppel
