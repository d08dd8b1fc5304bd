# gdb commands for programs that fly something: gdb -x orrery.gdb --args <test program> ...
# Run with --orrery_break_at=SECONDS to stop at simulated time (breakpoint sim_debug_break).

set breakpoint pending on
# The limit of host time (FlightOptions::host_time_limit); it ends no call under a debugger.
handle SIGVTALRM nostop noprint pass

define orrery-state
  call (void) orrery_debug_state()
end
document orrery-state
Prints every spacecraft of the worlds that are alive, with seed, simulated time and last event.
Works within flight code too: nothing is allocated in its heap.
end

define orrery-where
  printf "%s at %lld ns since the GPS epoch (event %llu)\n", sim_process, (long long) sim_now, (unsigned long long) sim_event
end
document orrery-where
Prints whose flight code runs, and when.
end

define orrery-break
  break $arg1 if $_streq(sim_process, "$arg0")
end
document orrery-break
orrery-break SPACECRAFT/PROCESS LOCATION: stops in the flight code of that process only, whichever
copy of its library it runs: orrery-break deputy/gnc FormationKeeping::tick
end

define orrery-event
  watch sim_event if sim_event == $arg0
end
document orrery-event
orrery-event N: stops when event N of a run begins (orrery-state and failures print numbers of events).
A watchpoint of the processor on a thread-local variable: the program must have been started.
end

define orrery-symbols
  sharedlibrary /$arg0\.
end
document orrery-symbols
orrery-symbols SPACECRAFT: reads the symbols of that spacecraft's copies only, after
"set auto-solib-add off". Many copies of a large library cost gdb seconds each.
end
