// A shared library that is no controller.

extern "C" int doppel_test_nothing() {
  return 0;
}
