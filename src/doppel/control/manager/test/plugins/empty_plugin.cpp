// A shared library without a controller.

extern "C" __attribute__((visibility("default"))) int doppel_test_nothing() {
  return 0;
}
