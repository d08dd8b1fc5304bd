// Carries the precompiled header of all suites (orrery_precompile_for_suites).
int main() {
  return 0;
}
