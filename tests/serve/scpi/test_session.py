"""What commands do to a station, and what they answer."""

from __future__ import annotations

import asyncio
import math

import numpy as np
import pytest

import macromicro
from macromicro.control.live import messages as m
from macromicro.control.live.targets import reach
from macromicro.serve.settings import LiveSettings
from macromicro.serve.shared import NAMES, Shared
from macromicro.serve.snapshot import Trouble

OWN = LiveSettings().live.limits
REACH = reach(LiveSettings().live, OWN, LiveSettings().controller.sequence.tolerance)


def test_identification(bench) -> None:
    fields = bench.ask("*IDN?").split(",")
    assert len(fields) == 4 and fields[0] == "macromicro" and fields[3] == macromicro.__version__
    assert bench.ask("SYST:VERS?") == "1999.0"
    assert bench.ask("*TST?") == "0"


@pytest.mark.parametrize(
    ("message", "request_"),
    [
        ("MOVE:ABS 42.123 MM", m.MoveTo(0.042123, "test")),
        ("MOVE 42.123 MM", m.MoveTo(0.042123, "test")),
        (":move:absolute 42123 um", m.MoveTo(0.042123, "test")),
        ("MOVE:REL -0.5 MM", m.MoveBy(-0.0005, "test")),
        ("MOVE:MACR 590", m.MoveMacro(590.0, "test")),
        ("MOVE:MACR 590 COUNTS", m.MoveMacro(590.0, "test")),
        ("MOVE:MICR 1.5 MM", m.MoveMicro(1.5e-3, "test")),
        ("MOVE 42.123 MM,REPL", m.MoveTo(0.042123, "test", True)),
        ("MOVE:REL -0.5 MM,REPLACE", m.MoveBy(-0.0005, "test", True)),
        ("MOVE:MACR 590,repl", m.MoveMacro(590.0, "test", True)),
        ("MOVE:MICR MAX,REPL", m.MoveMicro(OWN.micro_high, "test", True)),
        ("JOG:MACR -5 MM/S", m.Jog("macro", -0.005, client="test")),
        ("JOG:MICR 100 UM/S", m.Jog("micro", 0.0001, client="test")),
        ("SPE:MACR 5 MM/S", m.SetSpeed("macro", 0.005, "test")),
        ("SPE:X 10 MM/S", m.SetSpeed("x", 0.01, "test")),
        ("HOME", m.Home("test")),
        ("ZERO", m.Zero("test")),
        ("DIS", m.Disable("test")),
        ("FAN ON", m.Fan(True, "test")),
        ("FAN 0", m.Fan(False, "test")),
        ("FAN 2", m.Fan(True, "test")),
        ("MOVE:ABS\0MAX", m.MoveTo(REACH[1], "test")),
        ("MOVE:ABS MIN", m.MoveTo(REACH[0], "test")),
        ("MOVE:ABS 0", m.MoveTo(0.0, "test")),
        ("JOG:MACR 0", m.Jog("macro", 0.0, client="test")),
        ("MOVE:MACR MIN", m.MoveMacro(OWN.macro_low, "test")),
        ("MOVE:MICR MAXIMUM", m.MoveMicro(OWN.micro_high, "test")),
        ("PROG:STOP", m.Stop("test")),
        ("FAUL:CLE", m.ClearFault(client="test")),
        ("STOP", m.Stop("test")),
        ('GAIN "sequence.wait",1.5', m.SetGains((("sequence.wait", 1.5),), "test")),
        ('GAIN "macro_law","pid"', m.SetGains((("macro_law", "pid"),), "test")),
        ('GAIN "sequence.park",0', m.SetGains((("sequence.park", 0),), "test")),
    ],
)
def test_a_command_is_one_request(bench, message, request_) -> None:
    assert bench.ask(message) == ""
    assert bench.errors() == []
    assert bench.requests == [request_]
    assert [type(x) for x in bench.requests[0]] == [type(x) for x in request_]


@pytest.mark.parametrize(
    ("message", "number"),
    [
        ("MOVE:ABS 42.123", -131),
        ("MOVE:ABS 42.123 V", -131),
        ("MOVE:ABS 900 MM", -222),
        ("MOVE:ABS -20 MM", -222),
        ("MOVE:ABS NAN MM", -103),
        ("MOVE:ABS", -109),
        ("MOVE:ABS 1 MM,2 MM", -104),
        ("MOVE:ABS 1 MM,SOON", -224),
        ("MOVE:ABS 1 MM,REPL,2 MM", -108),
        ("MOVE:ABSO 1 MM", -113),
        ("MOVE:REL 500 MM", -222),
        ("MOVE:MACR 590.5", -222),
        ("MOVE:MACR 590 MM", -131),
        ("MOVE:MACR 5000", -222),
        ("MOVE:MICR 3.9 MM", -222),
        ("MOVE:MICR 1.5", -131),
        ("JOG:MACR 5", -131),
        ("JOG:MACR 5 MM", -131),
        ("FAN BIG", -224),
        ("MOVE:ABS DEF", -224),
        ("MOVE:ABS? DEF", -224),
        ("HOME 1", -108),
        ("HOME?", -113),
        ("MOVE:ABS 1 MM;FOO", -113),
        ("FOO;MOVE:ABS 1 MM", -113),
        ('GAIN "sequence.wait",-1', -222),
        ('GAIN "sequence.park",0.5', -222),
        ('GAIN "sequence.park",2', -222),
        ('GAIN "macro_law","bang"', -224),
        ('GAIN "macro_law",3', -224),
        ('GAIN "sequence.wait","x"', -104),
        ('GAIN "nothing",1', -224),
        ("PROG:RUN", -282),
        ('PROG:LOAD "../../etc/passwd"', -256),
        ("PROG:LOAD #14a = ", -285),
        ('REC ON,"../x"', -257),
        ("REC OFF", -221),
        ("LIM:ABS 0 MM,900 MM", -222),
        ("LIM:ABS 100 MM,50 MM", -222),
        ("\x00@MOVE:ABS 1 MM", -102),
        ("ÿMOVE:ABS 1 MM", -101),
    ],
)
def test_what_is_refused_moves_nothing(bench, message, number) -> None:
    bench.ask(message)
    assert bench.errors() == [number]
    assert bench.requests == []
    assert not bench.station.recording.active


def test_enabling_what_is_enabled_is_no_error(bench) -> None:
    """So a message that begins with it goes on."""
    bench.ask("ENAB;HOME")
    assert bench.requests == [m.Home("test")] and bench.errors() == []
    bench.ask("*RST;ENAB")
    assert bench.requests[-1] == m.Enable("test") and bench.station.mode == "ready"


def test_ends_of_what_is_allowed(bench) -> None:
    """MINimum and MAXimum: what is accepted now for a move, the machine's for a limit."""
    assert bench.ask("MOVE:ABS? MIN;ABS? MAX") == f"{REACH[0] * 1e3:.9g};{REACH[1] * 1e3:.9g}"
    machine = bench.ask("LIM:ABS?")
    bench.ask("LIM:ABS 10 MM,MAX;MICR 0.5 MM,DEF")
    assert bench.station.s.limits == OWN._replace(whole_low=0.01, micro_low=0.5e-3)
    assert bench.ask("MOVE? MIN;:LIM:ABS?") == f"10;10,{machine.split(',')[1]}"
    assert bench.ask("LIM:ABS? DEF") == machine
    assert bench.ask("MOVE:MICR? MIN;MACR? MAX") == f"0.5;{OWN.macro_high:g}"
    bench.ask("LIM:ABS MIN,DEF")
    assert bench.ask("LIM:ABS?") == machine and bench.errors() == []


def test_the_target_of_the_whole(bench) -> None:
    assert bench.ask("MOVE:ABS?") == "9.91E37"  # ready, nothing held
    bench.station.target, bench.station.mode = 0.0125, "holding"
    assert bench.ask("MOVE:ABS?;MACR?;MICR?") == "12.5;589;0.3" and bench.errors() == []


def test_gains_as_at_the_start(bench) -> None:
    bench.ask("GAIN:DEF")
    assert bench.requests == []
    bench.ask('GAIN "sequence.wait",1.5;GAIN "macro_law","pid"')
    bench.ask("GAIN:DEF")
    own = bench.instrument.settings.controller
    changes = (("macro_law", own.macro_law), ("sequence.wait", own.sequence.wait))
    assert sorted(bench.requests[-1].changes) == sorted(changes)
    assert bench.ask('GAIN? "sequence.wait";:GAIN? "macro_law"') == '2;"pd-tuned"'
    assert bench.errors() == []


@pytest.mark.parametrize("message", ["MOVE:NUMB?;STOP", "PROG:STAT?;STOP", "STAT:OPER?;*ESR?;STOP"])
def test_a_stop_is_a_stop_behind_any_path(watcher, message) -> None:
    watcher.ask(message)
    watcher.ask("MOVE:NUMB?;ABOR;NUMB?")  # what comes behind it starts from the root
    assert watcher.requests == [m.Stop("test")]
    assert watcher.station.emergencies == 1 and watcher.errors() == [-113]


def test_one_stop_of_each_kind_at_once(bench) -> None:
    """A message with a thousand of them is one."""
    bench.ask("ABOR;" * 300 + "STOP;:PROG:STOP;:" * 300)
    assert bench.station.emergencies == 1 and bench.requests == [m.Stop("test")]
    bench.station.mode = "ready"
    bench.ask("MOVE:ABS 1 MM;:STOP;:MOVE:ABS 2 MM;:STOP;:FOO")  # broken: but for its stops
    assert [type(r) for r in bench.requests] == [m.Stop, m.Stop]


def test_headers_say_which_have_no_query(bench) -> None:
    lines = bench.ask("SYST:HELP:HEAD?")[6:].split("\n")  # behind the block's head
    assert {"*IDN?/qonly/", "*RST/nquery/", "*ESE", "MOVE[:ABSolute]", "STOP/nquery/"} <= set(lines)
    assert len(lines) == len(set(lines))


def test_masks_are_rounded(bench) -> None:
    """IEEE 488.2, 10.10."""
    assert bench.ask("*ESE 3.7;*ESE?;*ESE 255.4;*ESE?;*ESE -0.4;*ESE?") == "4;255;0"
    bench.ask("*ESE 255.5")
    assert bench.errors() == [-222]


def test_limits_narrow_what_all_clients_may(bench) -> None:
    machine = bench.ask("LIM:ABS?;MACR?;MICR?")
    own = bench.instrument.settings.live.limits
    assert machine.split(";")[1] == f"{own.macro_low:g},{own.macro_high:g}"
    bench.ask("LIM:ABS 40 MM,5 CM")
    assert bench.ask("LIM:ABS?") == "40,50"
    bench.ask("MOVE:ABS 50.001 MM")
    assert bench.errors() == [-222]
    bench.ask("MOVE:REL 8 MM")  # from 42.12 mm
    assert bench.errors() == [-222]
    bench.ask("LIM:MACR 0,4000")  # wider than the machine's own
    assert bench.errors() == [-222]
    bench.ask("MOVE:ABS 50 MM")
    narrower = own._replace(whole_low=0.04, whole_high=0.05)
    assert bench.requests == [m.SetLimits(narrower, "test"), m.MoveTo(0.05, "test")]
    bench.ask("LIM:DEF")
    assert bench.ask("LIM:ABS?;MACR?;MICR?") == machine
    bench.ask("LIM:MICR 0.5 MM,3 MM;MACR 100,200")
    assert bench.ask("LIM:MICR?;MACR?") == "0.5,3;100,200"
    assert bench.errors() == []


def test_without_control_nothing_reaches_the_station(watcher) -> None:
    for message in ("MOVE:ABS 1 MM", "HOME", "ENAB", "FAN ON", "*RST", "LIM:DEF", "REC ON"):
        watcher.ask(message)
        assert watcher.errors() == [-203], message
    assert watcher.requests == []
    watcher.ask("STOP;ABOR")
    assert watcher.requests == [m.Stop("test")] and watcher.station.emergencies == 1
    assert watcher.errors() == []


def test_control(bench, watcher) -> None:
    assert bench.ask("SYST:LOCK:OWN?") == '"test"'
    bench.station.holder = "web"
    assert bench.ask("SYST:LOCK:REQ?") == "0"
    assert bench.errors() == [-203]
    bench.ask("SYST:LOCK:REL")
    assert bench.errors() == [-203]
    bench.station.holder = "test"
    bench.ask("SYST:LOCK:REL")
    assert bench.ask("SYST:LOCK:OWN?") == '""'


def test_token(guarded) -> None:
    for message in ("SYST:LOCK:REQ?", "MOVE:ABS 1 MM", "*RST", 'PROG:LOAD "thesis"', "REC ON"):
        guarded.ask(message)
        assert guarded.errors() == [-203], message
    assert guarded.station.holder == "" and guarded.requests == []
    assert guarded.ask("POS?").startswith("42.1234,")
    guarded.ask("STOP;ABOR")
    assert guarded.station.emergencies == 1
    for wrong in ('""', '"open sesam"', '"OPEN SESAME"'):
        guarded.ask(f"SYST:AUTH {wrong}")
        assert guarded.errors() == [-203]
        guarded.ask("SYST:LOCK:REQ?")
        assert guarded.errors() == [-203]
    assert guarded.session.failures == 3
    guarded.ask('SYST:AUTH "open sesame"')
    assert guarded.ask("SYST:LOCK:REQ?") == "1"
    guarded.station.mode = "ready"
    guarded.ask("MOVE:ABS 1 MM")
    assert guarded.requests[-1] == m.MoveTo(0.001, "test") and guarded.errors() == []


@pytest.mark.parametrize("outcome", [o for o in m.OUTCOMES if o != m.DONE])
def test_a_motion_that_ends_otherwise_is_an_error(bench, outcome) -> None:
    bench.ask("*CLS;:MOVE:ABS 10 MM;*OPC")
    assert bench.ask("*ESR?") == "0"
    bench.station.end(outcome)
    entry = bench.ask("SYST:ERR?")
    assert -299 <= int(entry.split(",")[0]) <= -200 and outcome in entry
    assert int(bench.ask("*ESR?")) == 16 + 1  # execution error; operation complete
    assert bench.ask("MOVE:OUTC? 1").startswith(f'"{outcome}",10,0.03,')


def test_a_motion_that_is_done_is_none(bench) -> None:
    bench.ask("*CLS;:MOVE:ABS 10 MM;*OPC")
    assert bench.ask("MOVE:NUMB?;OUTC? 1").startswith('1;"unknown",9.91E37')
    bench.station.end("done")
    assert bench.ask("*ESR?;:SYST:ERR:COUN?") == "1;0"


def test_loop_gone_ends_the_wait(bench) -> None:
    bench.ask("MOVE:ABS 10 MM")
    assert not bench.session.poll()
    bench.station.running = False
    assert bench.session.poll()
    assert bench.errors() == [-240]


def test_a_jog_is_waited_for_once_it_is_being_ended(bench) -> None:
    bench.ask("JOG:MACR 5 MM/S")
    assert bench.session.poll()
    bench.session.ends(bench.station.motion)  # as a jog at speed 0 does
    assert not bench.session.poll()
    bench.station.end("stopped")
    assert bench.session.poll() and bench.errors() == []


def test_a_stop_is_waited_for(bench, monkeypatch) -> None:
    """*OPC? answers at rest, also for who has not begun the motion; that is no error."""
    bench.ask("JOG:MACR 5 MM/S")
    end = bench.station.end
    monkeypatch.setattr(bench.station, "end", lambda outcome: None)  # it takes its time
    bench.ask("STOP")
    assert not bench.session.poll()
    end("stopped")
    assert bench.session.poll() and bench.errors() == []


def test_an_error_in_a_message_ends_its_orders(bench) -> None:
    """A move behind one that was refused would start from another place than meant."""
    bench.ask("MOVE:ABS 10 MM;:MOVE:ABS 20 MM;:FAN ON;*IDN?")
    assert [type(r) for r in bench.requests] == [m.MoveTo, m.MoveTo]
    assert bench.errors() == [-221, -200]


def test_a_stop_in_a_broken_message_is_heard(bench) -> None:
    bench.ask("MOVE:ABS 1 MM;FOO 3;ABOR")
    assert bench.station.emergencies == 1 and bench.requests == []
    bench.ask("@#!;STOP")
    assert bench.requests == [m.Stop("test")]


def test_orders_from_before_a_stop_are_dropped(bench) -> None:
    from macromicro.serve.scpi._message import parse
    from macromicro.serve.scpi.server import attempt
    from macromicro.serve.scpi.tree import TREE

    session = bench.session
    (unit,) = parse(TREE, b"MOVE:ABS 1 MM").units
    stops, failed = session.stops, session.failed
    asyncio.run(session.stop())
    assert asyncio.run(attempt(session, unit, stops, failed)) is None
    assert bench.requests == [m.Stop("test")] and bench.errors() == [-200]


def test_control_is_not_given_to_who_has_gone(watcher) -> None:
    """Nobody would give it back."""
    watcher.session.close()
    assert watcher.ask("SYST:LOCK:REQ?") == "" and watcher.errors() == [-200]


def test_rows_of_a_station_that_was_started_again(bench) -> None:
    """Its rows count from 0 anew, fewer than were seen before."""
    assert bench.instrument.newest(10)[0].tolist() == list(bench.station.rows[0, -10:])
    bench.station.rows = bench.station.rows[:, :100]
    assert bench.instrument.newest(10)[0].tolist() == list(bench.station.rows[0, -10:])
    assert bench.instrument.newest(500).shape == (len(NAMES), 100)


def test_status_byte_and_registers(bench) -> None:
    assert bench.ask("*ESR?;*ESR?") == "128;0"
    bench.ask("*ESE 32;*SRE 36")
    assert bench.ask("*ESE?;*SRE?;*STB?") == "32;36;16"  # 16: this message has answered
    bench.ask("NONSENSE")
    assert bench.ask("*STB?") == str(4 + 32 + 64)
    assert bench.ask("SYST:ERR?").startswith('-113,"Undefined header;')
    assert bench.ask("*ESR?;*STB?") == "32;16"
    bench.ask("STAT:OPER:ENAB 256;:STAT:QUES:ENAB #H0800")
    bench.ask("MOVE:ABS 10 MM")
    assert bench.ask("*STB?") == "128"
    assert bench.ask("STAT:OPER:COND?") == str(256 + 8192)
    assert bench.ask("STAT:OPER?;*STB?") == f"{256 + 8192};16"
    bench.station.fault = Trouble(8, "carriage stuck", "It is stuck.", "3.6 V", "Free it.")
    assert bench.ask("STAT:QUES:COND?") == str((1 << 9) + (1 << 11))
    assert bench.ask("FAUL?") == '8,"carriage stuck","It is stuck.","3.6 V","Free it."'
    assert int(bench.ask("*STB?")) & 8
    assert bench.ask("*TST?") == "4"
    bench.ask("*CLS")
    assert bench.ask("*STB?") == "0"


def test_modes_between_two_looks_are_seen(bench) -> None:
    bench.ask("*CLS")
    bench.station.go("homing")
    bench.station.go("ready")
    assert int(bench.ask("STAT:OPER:EVEN?")) & (1 << 10)
    assert not int(bench.ask("STAT:OPER:COND?")) & (1 << 10)
    bench.ask("STAT:OPER:PTR 0;NTR 1024")
    bench.ask("STAT:OPER?")
    bench.station.go("homing")
    assert bench.ask("STAT:OPER?") == "0"
    bench.station.go("ready")
    assert bench.ask("STAT:OPER?") == "1024"
    bench.ask("STAT:PRES")
    assert bench.ask("STAT:OPER:PTR?;NTR?;ENAB?") == "32767;0;0"


def test_error_queue_overflow(bench) -> None:
    """SCPI-99, volume 2, 21.8.1: the last one becomes -350."""
    for _ in range(40):
        bench.ask("NONSENSE")
    assert bench.ask("SYST:ERR:COUN?") == "32"
    assert int(bench.ask("*ESR?")) & 8  # -350 is a device's error
    assert bench.errors() == [-113] * 31 + [-350]
    assert bench.ask("SYST:ERR?") == '0,"No error"'
    bench.ask("A;B")
    bench.ask('MOVE "')
    found = bench.ask("SYST:ERR:ALL?")
    assert found.startswith('-113,"Undefined header;A"') and ',-151,"Invalid string' in found


def test_queries(bench) -> None:
    assert bench.ask("POS?;POS:TRUS?") == '42.1234,0.0357,1;1,"homed"'
    assert bench.ask("STAG:POS?;TARG?;OUTP?") == "590;589;9.91E37"
    assert bench.ask("STAG2:POS?;:STAG2:TARG?;:STAG2:OUTP?") == "0.31;0.3;1.5"
    assert bench.ask("MODE?;TEMP?;FAN?;ENAB?") == '"ready";61.5;0;1'
    assert bench.ask("DIAG:PACE?;ABOR?") == "1000,3,0.003,1500,200;9.91E37"
    assert bench.ask("FAUL?") == '0,"none","","",""'


def test_gains(bench) -> None:
    assert '"pd_tuned.now"' in bench.ask("GAIN:CAT?")
    assert bench.ask('GAIN? "sequence.wait"') == "2"
    assert bench.ask('GAIN:BOUN? "sequence.wait"').startswith('0,600,"s","wait between')
    bench.ask('GAIN "sequence.wait",1.5')
    assert bench.ask('GAIN? "sequence.wait"') == "1.5"
    assert bench.ask('GAIN? "macro_law"') == '"pd-tuned"'
    assert bench.errors() == []


def test_gains_of_the_micro_stage_are_in_volts_per_mm(bench) -> None:
    """As in the settings files; the machine has them in V/m."""
    assert bench.ask('GAIN? "pi_antiwindup.kp";:GAIN? "pi_antiwindup.ki"') == "3;30"
    assert bench.ask('GAIN:BOUN? "pi.kp"').startswith('0,1000,"V/mm","proportional gain"')
    bench.ask('GAIN "pi_antiwindup.kp",1.5')
    assert bench.requests[-1].changes == (("pi_antiwindup.kp", 1500.0),)
    assert bench.ask('GAIN? "pi_antiwindup.kp"') == "1.5" and bench.errors() == []
    facts = {"pi_antiwindup.kp": {"old": 3000.0, "new": 1500.0}}
    bench.station.told.append(m.Event(1.5, "gains", "ready", "ready", "set gains", facts))
    limits = {"micro_low": {"old": 0.0, "new": 0.5e-3}, "whole_low": {"old": 0.0, "new": 0.01}}
    bench.station.told.append(m.Event(1.5, "limits", "ready", "ready", "set limits", limits))
    told = [bench.ask("EVEN?") for _ in range(3)]
    assert '{""old"": 3.0, ""new"": 1.5}' in told[1]
    assert '""micro_low"": {""old"": 0.0, ""new"": 0.5}' in told[2]
    assert '""whole_low"": {""old"": 0.0, ""new"": 0.01}' in told[2]
    bench.ask('GAIN "pi_antiwindup.kp",2000')
    error = bench.ask("SYST:ERR?")
    assert error.startswith("-222,") and "2000 V/mm; accepted: from 0 V/mm to 1000 V/mm" in error


def test_programme_by_name_and_as_text(bench) -> None:
    assert bench.ask("PROG:CAT?").startswith('"fast"')
    bench.ask('PROG:LOAD "thesis"')
    assert bench.ask("PROG:NAME?;STAT?") == '"thesis";STOP'
    bench.ask("PROG:RUN")
    (request,) = bench.requests
    assert isinstance(request, m.Programme)
    assert request.plan.target[0] == pytest.approx(190e-3 / (0.2 / 2800), abs=0.5)
    assert bench.ask("PROG:STAT?") == "RUN"
    bench.ask("PROG:STOP")
    assert bench.requests[1:] == [m.Stop("test")]
    assert bench.ask("SYST:ERR?").startswith('-200,"Execution error;programme thesis (motion 1)')
    text = b'title = "Two"\n[[moves]]\nmicro = ["1 mm", "2 mm"]\nhold = "1 s"\n'
    bench.send(b"PROG:LOAD #2%d" % len(text) + text + b";NAME?")
    assert bench.ask("PROG:NAME?") == '"Two"' and bench.errors() == []
    bench.ask("PROG:RUN")
    assert bench.requests[-1].plan.target.tolist() == [1e-3, 2e-3]
    assert bench.requests[-1].plan.stage.tolist() == [1, 1]


def test_programme_error_names_no_file(bench) -> None:
    text = b'[[moves]]\nmacro = "900 mm"\nhold = "1 s"\n'
    bench.send(b"PROG:LOAD #2%d" % len(text) + text)
    entry = bench.ask("SYST:ERR?")
    assert entry.startswith('-285,"Program syntax error;programme, move 1, macro')
    assert "/tmp" not in entry


def test_profiles_are_refused_for_they_begin_at_zero(bench) -> None:
    text = b'[[profiles]]\nmacro = "9 mm"\nvelocity = "1 m/s"\n'
    text += b'acceleration = "1 m/s^2"\nhold = "1 s"\n'
    bench.send(b"PROG:LOAD #2%d" % len(text) + text)
    entry = bench.ask("SYST:ERR?")
    assert "motion profiles" in entry and "[[moves]]" in entry
    text = b'[[moves]]\nmacro = "5 mm"\nhold = "1 s"\n' + text
    bench.send(b"PROG:LOAD #3%d" % len(text) + text)
    bench.ask("PROG:RUN")
    plan = bench.requests[-1].plan
    assert bench.errors() == [] and plan.target[0] == 70.0 and plan.target[-1] == 126.0
    assert (plan.start[2:] == -math.inf).all()


def test_programme_within_narrowed_limits(bench) -> None:
    bench.ask('PROG:LOAD "thesis"')
    bench.ask("LIM:MACR 0,1000")
    bench.requests.clear()
    bench.ask("PROG:RUN")
    assert bench.errors() == [-222] and bench.requests == []


def test_waveforms(bench) -> None:
    row = NAMES.index("hall_position")
    expected = bench.station.rows[row, -3:]
    assert [float(x) for x in bench.ask("WAV:DATA? hall_position,0.003").split(",")] == list(
        expected
    )
    for order, code in (("NORM", ">"), ("SWAP", "<")):
        for length in (32, 64):
            bench.ask(f"FORM REAL,{length};:FORM:BORD {order}")
            data = bench.send('WAV:DATA? "HALL_POSITION",3 MS')
            size = 3 * length // 8
            head = f"#{len(str(size))}{size}".encode()
            assert data.startswith(head)
            values = np.frombuffer(data[len(head) :], f"{code}f{length // 8}")
            assert values == pytest.approx(expected)
    assert bench.ask("FORM?;FORM:BORD?") == "REAL,64;SWAP"
    assert bench.station.copied[0] == 5000 and max(bench.station.copied[1:]) < 2000
    assert len(bench.send("WAV:DATA? t,60 S")) == 7 + 5000 * 8  # all there is
    assert bench.send("WAV:DATA? t,0 S") == b"#10"
    assert bench.ask("WAV:CAT?").split(",")[0] == '"t"' and bench.errors() == []
    for message in ("WAV:DATA? nothing,1", "WAV:DATA? t,61 S", "FORM REAL,16", "FORM ASC,64"):
        bench.ask(message)
        assert bench.errors()[0] in (-224, -222)


def test_recording(bench, tmp_path) -> None:
    bench.ask('REC ON,"run-1"')
    assert bench.station.recording.path == str(tmp_path / "run-1.h5")
    assert bench.ask("REC?;REC:NAME?") == '1,12,0,"";"run-1.h5"'
    bench.ask("REC ON")
    assert bench.errors() == [-250]
    bench.ask("REC OFF")
    assert bench.ask("REC?").startswith("0,") and bench.errors() == []


def test_events(bench) -> None:
    assert bench.ask("EVEN?") == '0,0,"none","","","",""'
    bench.station.go("homing")
    bench.station.go("ready")
    assert bench.ask("EVEN:COUN?") == "2"
    first = bench.ask("EVEN?")
    assert first == '1,1.5,"mode","ready","homing","test","{""error_mm"": 0.25}"'
    assert bench.ask("EVEN?").startswith('2,1.5,"mode","homing","ready"')
    assert bench.ask("EVEN?").startswith("0,")


def test_reset(bench) -> None:
    machine = bench.ask("LIM:MACR?")
    bench.ask("FORM REAL;:LIM:MACR 0,100;*OPC;:MOVE:ABS 10 MM")
    bench.ask("*RST")
    assert [type(r) for r in bench.requests[2:]] == [m.Disable, m.SetLimits, m.Fan]
    assert bench.ask("FORM?;:LIM:MACR?") == f"ASC,0;{machine}"
    assert bench.errors() == [-200]  # the motion was stopped


def test_nothing_not_declared_answers(bench) -> None:
    """Queries answer one line each, of printable ASCII; commands answer nothing."""
    from macromicro.serve.scpi.tree import COMMANDS

    given = {
        "MOVE:OUTCome?": " 1",
        "GAIN?": ' "p.kp"',
        "GAIN:BOUNds?": ' "p.kp"',
        "WAVeform:DATA?": " t,0.01",
        "CAPTure:DATA?": " t",
    }
    ring = bench.station.loop.shared = Shared.create(100)
    bench.ask('CAPT:SIGN "position";AFT 0;STAR')
    ring.put([0.0] * len(NAMES))
    bench.station.captures.look()
    for command in COMMANDS:
        header = command.header.replace("[", "").replace("]", "").replace("<n=1..2>", "")
        if command.query:
            answer = bench.ask(header + given.get(command.header, ""))
            assert answer, command.header
            lines = command.header == "SYSTem:HELP:HEADers?"
            assert all(" " <= c <= "~" or (lines and c == "\n") for c in answer)
            assert command.answer, command.header
        else:
            assert command.answer == ""
        assert command.text.endswith((".", "?"))
    assert bench.errors() == [] and math.isnan(bench.station.snapshot().motor_v)


def test_an_emergency_stop_without_an_answer_says_to_cut_the_power(
    bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bench.station, "emergency", lambda client="": math.nan)
    bench.send("ABOR")
    said = "Emergency stop not confirmed: the control loop does not respond. Cut the power now."
    assert bench.ask("SYST:ERR?") == f'-240,"Hardware error;{said}"'
