// A shared library that is no controller.

extern "C" __attribute__((visibility("default"))) int doppel_test_nothing() {
  return 0;
}
