#include <orrery/harness/flight/containment.hpp>
#include <orrery/harness/flight/file_services.hpp>
#include <orrery/harness/flight/floating_point.hpp>
#include <orrery/harness/flight/virtual_services.hpp>
#include <orrery/harness/heap/interposition.hpp>
#include <orrery/harness/kernel/sanitizers.hpp>
#include <orrery/harness/kernel/sim_state.hpp>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <cxxabi.h>
#include <exception>
#include <fcntl.h>
#include <map>
#include <mutex>
#include <optional>
#include <pthread.h>
#include <setjmp.h>
#include <signal.h>
#include <stdexcept>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <time.h>
#include <typeinfo>
#include <unistd.h>
#include <unwind.h>

#ifdef ORRERY_ADDRESS_SANITIZER
#include <sanitizer/lsan_interface.h>
#endif

namespace orrery::internal {
namespace {

constexpr std::array<int, 5> kSignals = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};

// The call that is on this thread's stack. There is at most one: calls do not nest.
struct RunningCall {
  sigjmp_buf jump;
  ContainedProcess* process = nullptr;
  CrashCapture* capture = nullptr;
  const void* boundary = nullptr;  // on the stack: what lies above is the simulator's
  void (*function)(void*) = nullptr;
  void* argument = nullptr;
  std::uint64_t serial = 0;
};

#define ORRERY_INITIAL_EXEC [[gnu::tls_model("initial-exec")]]

ORRERY_INITIAL_EXEC constinit thread_local RunningCall* running_call = nullptr;
// Flight code is what runs now. volatile: read by the signal handler.
ORRERY_INITIAL_EXEC constinit thread_local volatile bool in_flight_code = false;
ORRERY_INITIAL_EXEC constinit thread_local volatile bool unwinding = false;
ORRERY_INITIAL_EXEC constinit thread_local std::uint64_t last_serial = 0;

// Whatever uses CPU time sends it; debuggers let it pass without a word.
constexpr int kTimerSignal = SIGVTALRM;

struct sigaction previous_actions[kSignals.size()];
std::terminate_handler previous_terminate = nullptr;

// ---- leaving

struct Unwinding {
  const RunningCall* call;
  std::uintptr_t begin;  // the instruction that raised the signal, or 0
  bool begun;
};

_Unwind_Reason_Code add_frame(_Unwind_Context* context, void* argument) {
  Unwinding& state = *static_cast<Unwinding*>(argument);
  CrashCapture& capture = *state.call->capture;
  const std::uintptr_t address = _Unwind_GetIP(context);
  if (!state.begun && address != state.begin) return _URC_NO_REASON;
  // On the way from the signal's stack to the program's, addresses do not compare; so only from
  // here.
  state.begun = true;
  if (_Unwind_GetCFA(context) >= reinterpret_cast<std::uintptr_t>(state.call->boundary)) {
    return _URC_END_OF_STACK;
  }
  capture.frames[capture.frame_count++] = reinterpret_cast<void*>(address);
  return capture.frame_count == CrashCapture::kMostFrames ? _URC_END_OF_STACK : _URC_NO_REASON;
}

// `from`: see Unwinding::begin. The stack may be damaged, so a fault on it ends the walk.
void capture_stack(const RunningCall& call, std::uintptr_t from) {
  Unwinding state{&call, from, from == 0};
  unwinding = true;
  _Unwind_Backtrace(add_frame, &state);
  unwinding = false;
}

[[noreturn]] void leave(RunningCall& call, CrashKind kind, int signal, std::uintptr_t from) {
  in_flight_code = false;
  current_heap = nullptr;
  call.capture->kind = kind;
  call.capture->signal = signal;
  call.capture->frame_count = 0;
  capture_stack(call, from);
  siglongjmp(call.jump, 1);
}

std::uintptr_t instruction_of(void* context) {
#if defined(__x86_64__)
  return static_cast<std::uintptr_t>(static_cast<ucontext_t*>(context)->uc_mcontext.gregs[REG_RIP]);
#else
  (void)context;
  return 0;
#endif
}

// A fault near the stack pointer, far below the boundary: where a process has no stack of its own.
bool is_below_stack(const RunningCall& call, const void* address, void* context) {
#if defined(__x86_64__)
  constexpr std::uintptr_t kNear = 64 * 1024, kFar = 256 * 1024;
  const auto pointer =
      static_cast<std::uintptr_t>(static_cast<ucontext_t*>(context)->uc_mcontext.gregs[REG_RSP]);
  const auto fault = reinterpret_cast<std::uintptr_t>(address);
  return fault + kNear > pointer && fault < pointer + kNear &&
         pointer + kFar < reinterpret_cast<std::uintptr_t>(call.boundary);
#else
  (void)call, (void)address, (void)context;
  return false;
#endif
}

bool is_stack_overflow(const RunningCall& call, int signal, const siginfo_t& info, void* context) {
  if ((signal != SIGSEGV && signal != SIGBUS) || info.si_code <= 0) return false;
  const FlightStack* stack = call.process->stack;
  return stack != nullptr ? stack->guards(info.si_addr)
                          : is_below_stack(call, info.si_addr, context);
}

CrashKind kind_of_signal(const RunningCall& call, int signal, const siginfo_t& info,
                         void* context) {
  char* message = call.capture->message;
  constexpr std::size_t kSize = sizeof call.capture->message;
  if (is_stack_overflow(call, signal, info, context)) {
    char size[32] = "";
    if (const FlightStack* stack = call.process->stack) {
      std::snprintf(size, sizeof size, " of %llu bytes",
                    static_cast<unsigned long long>(stack->bytes()));
    }
    std::snprintf(message, kSize, "the stack%s is used up: %s at address %p", size,
                  sigdescr_np(signal), info.si_addr);
    return CrashKind::kStackOverflow;
  }
  if (info.si_code > 0) {
    std::snprintf(message, kSize, "%s at address %p", sigdescr_np(signal), info.si_addr);
  } else {
    std::snprintf(message, kSize, "%s raised", sigdescr_np(signal));
  }
  return signal == SIGABRT ? CrashKind::kAbort : CrashKind::kSignal;
}

// Not ours: as if this handler had never been there.
void pass_on(int signal, const siginfo_t& info) {
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    if (kSignals[i] == signal) sigaction(signal, &previous_actions[i], nullptr);
  }
  // A fault comes again when the instruction is repeated; a signal that was sent has to be sent.
  if (info.si_code <= 0) raise(signal);
}

void on_signal(int signal, siginfo_t* info, void* context) {
  RunningCall* call = running_call;
  const bool own = info->si_code > 0 || info->si_pid == getpid();
  if (call != nullptr && own && unwinding) {
    unwinding = false;
    siglongjmp(call->jump, 1);
  }
  if (call == nullptr || !in_flight_code || !own) {
    pass_on(signal, *info);
    return;
  }
  leave(*call, kind_of_signal(*call, signal, *info, context), signal, instruction_of(context));
}

// ---- the limit of host time

std::int64_t cpu_time_ns() {
  timespec t{};
  syscall(SYS_clock_gettime, CLOCK_THREAD_CPUTIME_ID, &t);
  return std::int64_t{1'000'000'000} * t.tv_sec + t.tv_nsec;
}

// Asked in a signal handler. A debugger may have come at any time. By system calls, since open and
// read would be those of the flight code that is running.
bool is_traced() {
  char text[4096];
  const long file = syscall(SYS_openat, AT_FDCWD, "/proc/self/status", O_RDONLY | O_CLOEXEC);
  if (file < 0) return false;
  const ssize_t bytes = syscall(SYS_read, file, text, sizeof text - 1);
  syscall(SYS_close, file);
  text[std::max<ssize_t>(bytes, 0)] = 0;
  const char* line = std::strstr(text, "TracerPid:");
  return line != nullptr && std::strtol(line + std::strlen("TracerPid:"), nullptr, 10) != 0;
}

bool under_valgrind() {
  const char* preload = std::getenv("LD_PRELOAD");
  return preload != nullptr && std::strstr(preload, "vgpreload") != nullptr;
}

struct WatchedCall {
  std::uint64_t serial = 0;
  std::int64_t since_ns = 0;
};
ORRERY_INITIAL_EXEC constinit thread_local WatchedCall watched;

// Every 0.1 s of this thread's CPU time: is it still the same call? So a call costs nothing.
void on_timer(int, siginfo_t*, void* context) {
  const int kept = errno;
  RunningCall* call = running_call;
  const bool limited = call != nullptr && in_flight_code && call->process->host_limit_ns > 0;
  if (limited && call->serial != watched.serial) {
    watched = {call->serial, cpu_time_ns()};
  } else if (limited && cpu_time_ns() - watched.since_ns >= call->process->host_limit_ns &&
             !is_traced()) {
    std::snprintf(call->capture->message, sizeof call->capture->message,
                  "the call used more than %.3f s of CPU time: an endless loop?",
                  1e-9 * static_cast<double>(call->process->host_limit_ns));
    leave(*call, CrashKind::kTimeout, 0, instruction_of(context));
  }
  errno = kept;
}

class CallTimer {
 public:
  CallTimer() {
    if (under_valgrind()) return;
    sigevent event{};
    event.sigev_notify = SIGEV_THREAD_ID;
    event.sigev_signo = kTimerSignal;
    event._sigev_un._tid = static_cast<pid_t>(syscall(SYS_gettid));
    works_ = timer_create(CLOCK_THREAD_CPUTIME_ID, &event, &timer_) == 0;
    const itimerspec period = {{0, 100'000'000}, {0, 100'000'000}};
    if (works_) timer_settime(timer_, 0, &period, nullptr);
  }
  ~CallTimer() {
    if (works_) timer_delete(timer_);
  }
  CallTimer(const CallTimer&) = delete;
  CallTimer& operator=(const CallTimer&) = delete;

 private:
  timer_t timer_{};
  bool works_ = false;
};

// "std::runtime_error: no fix"; the object is flight code's, so it is asked as flight code.
void describe_exception(char* text, std::size_t size) {
  const std::type_info* type = abi::__cxa_current_exception_type();
  if (type == nullptr) {
    std::snprintf(text, size, "std::terminate called");
    return;
  }
  int status = 0;
  char* readable = abi::__cxa_demangle(type->name(), nullptr, nullptr, &status);
  const char* name = status == 0 ? readable : type->name();
  try {
    throw;
  } catch (const std::exception& e) {
    std::snprintf(text, size, "uncaught %s: %s", name, e.what());
  } catch (...) {
    std::snprintf(text, size, "uncaught exception of type %s", name);
  }
}

void on_terminate() {
  RunningCall* call = running_call;
  if (call != nullptr && in_flight_code) {
    describe_exception(call->capture->message, sizeof call->capture->message);
    leave(*call, CrashKind::kException, 0, 0);
  }
  if (previous_terminate != nullptr) previous_terminate();
  std::abort();
}

void on_exit_called(int status) {
  char message[64];
  std::snprintf(message, sizeof message, "exit(%d) called", status);
  end_running_call(CrashKind::kExit, message);
}

bool keep_exit_function(void (*function)(void*), void* argument) {
  if (running_call == nullptr || !in_flight_code) return false;
  const SimulatorScope scope;
  running_call->process->exit_functions.push_back({function, argument});
  return true;
}

// Guards of statics within whose constructors a process crashed -> what to say of it.
std::map<const void*, std::string>& half_initialised() {
  static std::map<const void*, std::string> guards;
  return guards;
}

void static_wanted(const void* guard) {
  if (running_call == nullptr || !in_flight_code) return;
  char reason[sizeof CrashCapture::message] = "";
  {
    const SimulatorScope scope;
    const auto found = half_initialised().find(guard);
    if (found != half_initialised().end()) {
      std::snprintf(reason, sizeof reason, "%s", found->second.c_str());
    }
  }
  if (reason[0] != 0) end_running_call(CrashKind::kForbiddenCall, reason);
}

void static_begun(const void* guard) {
  if (running_call == nullptr || !in_flight_code) return;
  const SimulatorScope scope;
  running_call->process->statics_begun.push_back(guard);
}

void static_ended(const void* guard) {
  if (running_call == nullptr || !in_flight_code) return;
  const SimulatorScope scope;
  std::erase(running_call->process->statics_begun, guard);
}

int call_stack(void** frames, int most) {
  if (running_call == nullptr) return 0;
  CrashCapture capture;
  RunningCall call;  // the running one's capture is that of a crash
  call.boundary = running_call->boundary;
  call.capture = &capture;
  capture_stack(call, 0);
  const int count = std::min(capture.frame_count, most);
  std::copy(capture.frames, capture.frames + count, frames);
  return count;
}

constexpr ProcessHooks kProcessHooks = {keep_exit_function, on_exit_called, static_wanted,
                                        static_begun,       static_ended,   call_stack};

// ---- set-up

void install_once() {
  static std::once_flag once;
  std::call_once(once, [] {
    warm_up_libraries();
    // The unwinder loads its tables when it is first used: not in a signal handler, please.
    _Unwind_Backtrace([](_Unwind_Context*, void*) { return _URC_NO_REASON; }, nullptr);
    struct sigaction action {};
    action.sa_sigaction = on_signal;
    // The mask stays as it is, so that it need not be put back after every crash; a fault of the
    // unwinder must come through.
    action.sa_flags = SA_SIGINFO | SA_ONSTACK | SA_NODEFER;
    sigemptyset(&action.sa_mask);
    for (std::size_t i = 0; i < kSignals.size(); ++i) {
      sigaction(kSignals[i], &action, &previous_actions[i]);
    }
    struct sigaction timer {};
    timer.sa_sigaction = on_timer;
    timer.sa_flags = SA_SIGINFO | SA_ONSTACK | SA_NODEFER | SA_RESTART;
    sigemptyset(&timer.sa_mask);
    sigaction(kTimerSignal, &timer, nullptr);
    previous_terminate = std::set_terminate(on_terminate);
    process_hooks = &kProcessHooks;
    install_service_hooks();
    install_file_view();
  });
}

// A stack overflow leaves no room for the handler, so it has a stack of its own. The unwinder needs
// some 10 kB.
class SignalStack {
 public:
  SignalStack() {
    install_once();
    memory_ = mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (memory_ == MAP_FAILED) throw std::runtime_error("no memory for a signal stack");
    stack_t stack{};
    stack.ss_sp = memory_;
    stack.ss_size = kBytes;
    sigaltstack(&stack, &previous_);
    timer_.emplace();  // now that its handler is there
    pthread_sigmask(SIG_SETMASK, nullptr, &mask_);
  }
  ~SignalStack() {
    sigaltstack(&previous_, nullptr);
    munmap(memory_, kBytes);
  }
  const sigset_t& mask() const { return mask_; }
  void renew_timer() { timer_.emplace(); }

 private:
  static constexpr std::size_t kBytes = 128 * 1024;
  void* memory_;
  stack_t previous_{};
  sigset_t mask_;
  std::optional<CallTimer> timer_;
};

SignalStack& signal_stack_of_this_thread() {
  static thread_local SignalStack stack;
  return stack;
}

// What the C++ runtime keeps per thread: a crash within a catch block would leave it set.
struct ExceptionState {
  void* caught = nullptr;
  unsigned uncaught = 0;
  static ExceptionState& current() {
    return *reinterpret_cast<ExceptionState*>(abi::__cxa_get_globals());
  }
};

// An exception that gets here ends the process where it was thrown.
[[gnu::noinline]] void call_as_flight_code(void* running) noexcept {
  RunningCall& call = *static_cast<RunningCall*>(running);
  call.boundary = __builtin_frame_address(0);
  in_flight_code = true;
  call.function(call.argument);
  in_flight_code = false;
}

// Apart, so that no variable of a caller lives across the jump. True if the function returned.
[[gnu::noinline]] bool call_or_crash(RunningCall& call) {
  if (sigsetjmp(call.jump, 0) != 0) return false;
  if (call.process->stack != nullptr) {
    call.process->stack->call(call_as_flight_code, &call);
  } else {
    call_as_flight_code(&call);
  }
  return true;
}

}  // namespace

void renew_call_timer() {
  signal_stack_of_this_thread().renew_timer();
}

bool run_contained(ContainedProcess& process, void (*function)(void*), void* argument,
                   CrashCapture& capture) {
  const SignalStack& signal_stack = signal_stack_of_this_thread();
  if (running_call != nullptr) {
    throw std::logic_error(std::string("flight process ") + process.name +
                           ": a call within a call of " + running_call->process->name);
  }
  const ExceptionState exceptions = ExceptionState::current();
  const FloatingPointControl control = FloatingPointControl::read();
  const char* previous_name = sim_process;
  RunningCall call;
  call.process = &process;
  call.capture = &capture;
  call.function = function;
  call.argument = argument;
  call.serial = ++last_serial;
  capture.message[0] = 0;

  running_call = &call;
  sim_process = process.name;
  bool returned = false;
  {
    const HeapGuard guard(process.heap);
#ifdef ORRERY_ADDRESS_SANITIZER
    __lsan_disable();  // what a dead process had allocated is not a leak
#endif
    returned = call_or_crash(call);
#ifdef ORRERY_ADDRESS_SANITIZER
    __lsan_enable();
#endif
  }
  sim_process = previous_name;
  running_call = nullptr;
  if (FloatingPointControl::read() != control) {
    control.restore();
    process.changed_floating_point = true;
  }
  if (!returned) {
    ExceptionState::current() = exceptions;
    pthread_sigmask(SIG_SETMASK, &signal_stack.mask(), nullptr);
  }
  return returned;
}

bool call_in_progress() {
  return running_call != nullptr;
}

bool flight_code_is_running() {
  return running_call != nullptr && in_flight_code;
}

ContainedProcess* running_process() {
  return running_call == nullptr ? nullptr : running_call->process;
}

void mark_half_initialised(const void* guard, const std::string& reason) {
  half_initialised()[guard] = reason;
}

void end_running_call(CrashKind kind, const char* message) {
  RunningCall* call = running_call;
  if (call == nullptr || !in_flight_code) return;
  std::snprintf(call->capture->message, sizeof call->capture->message, "%s", message);
  leave(*call, kind, 0, 0);
}

SimulatorScope::SimulatorScope() : heap_(current_heap) {
  in_flight_code = false;
  current_heap = nullptr;
}

SimulatorScope::~SimulatorScope() {
  current_heap = heap_;
  in_flight_code = true;
}

}  // namespace orrery::internal
