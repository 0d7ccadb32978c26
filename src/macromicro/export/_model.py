"""model.c of an FMU: the unit's functions, called once a control period."""

from __future__ import annotations

from macromicro.export._routines import Routine
from macromicro.export._variables import Call, Interface
from macromicro.export.kinds import Rows, Several, Struct


class Model:
    def __init__(self, face: Interface) -> None:
        self.face, self.written, self.program = face, face.written, face.written.program
        self.name = self.written.name
        self.wholes = [v for v in face.variables if v.whole]

    def text(self, token: str) -> str:
        """The file; `token` is that of the description."""
        parts = (
            self._head(token), self._reset(), self._show(), self._start(), self._step(),
            self._moved(), self._at(),
        )  # fmt: skip
        return "\n".join(line for part in parts for line in (*part, ""))

    def _head(self, token: str) -> list[str]:
        lines = [
            f"/* {self.written.unit.title}: what an FMU asks of it. MIT licence. */",
            '#include "model.h"',
            "",
            "#include <math.h>",
            "#include <string.h>",
            "",
            f'#include "{self.name}.h"',
            "",
            f"#define PERIOD {self.written.unit.period!r} /* s */",
            "",
            f'const char MODEL_TOKEN[] = "{token}";',
            "",
            "struct Model {",
            "    double time, began; /* s */",
            "    double periods; /* since then */",
            "    double behind; /* what of the last step made no whole period, s */",
        ]
        for kind, field in self.face.fields:
            if isinstance(kind, Routine):
                layout = kind if isinstance(kind.result, Several) else None
                lines.append(f"    {self.program.declared(kind.result, field, layout=layout)};")
            elif isinstance(kind, Rows):
                sizes = "".join(f"[{n or 1}]" for n in kind.shape)
                lines.append(f"    {self.program.real} {field}{sizes};")
            else:
                lines.append(f"    {self.program.declared(kind, field)};")
        if self.written.store:
            lines.append(f"    {self.program.struct(self.face.state)}Store store;")
        if self.wholes:
            lines.append(f"    double whole[{len(self.wholes)}]; /* copies of whole numbers */")
        return [*lines, "};", "", "size_t model_size(void) { return sizeof(Model); }"]

    def _reset(self) -> list[str]:
        lines = ["void model_reset(Model *m)", "{", "    memset(m, 0, sizeof *m);"]
        lines += [f"    m->given_{key} = {self.name}_{key};" for key in self.written.unit.given]
        for field, value, kind in self.face.starts:
            text = self.program.plain(value, kind, lambda v, k: "NULL")
            if isinstance(kind, Struct | Several):
                text = f"({self.program.struct(kind)}){text}"
            lines.append(f"    m->{field} = {text};")
        return [*lines, "}"]

    def _show(self) -> list[str]:
        shown = [c for c in self.face.calls if c.moves is None and not c.kept]
        calls = [f"    m->out_{call.entry} = {call.text};" for call in shown]
        copies = [f"    m->whole[{k}] = (double)m->{v.path};" for k, v in enumerate(self.wholes)]
        return ["void model_show(Model *m)", "{", *calls, *copies, "    (void)m;", "}"]

    def _start(self) -> list[str]:
        lines = [
            "void model_start(Model *m, double time)",
            "{",
            "    m->time = m->began = time;",
            "    m->periods = m->behind = 0.0;",
        ]
        if self.written.unit.state is not None:
            store = ", &m->store" if self.written.store else ""
            lines.append(f"    {self.name}_begin(&m->state{store});")
        first = self.face.calls[0]
        if first.moves == "" and first.entry == "start":
            lines.append(f"    m->state = {first.text};")
        return [*lines, "    model_show(m);", "}"]

    def _step(self) -> list[str]:
        lines = [
            "void model_step(Model *m, double length)",
            "{",
            "    m->behind += length;",
            "    while (m->behind > 0.5 * PERIOD) {",
            "        m->behind -= PERIOD;",
        ]
        for call in self.face.calls:
            lines += [f"        {line}" for line in self._moved_by(call)]
        return [
            *lines,
            "        m->periods += 1.0;",
            "        m->time = m->began + m->periods * PERIOD;",
            "    }",
            "    model_show(m);",
            "}",
        ]

    def _moved_by(self, call: Call) -> list[str]:
        """Effects of a period's call on the model."""
        out = f"m->out_{call.entry}"
        if call.moves == "":
            return [f"m->state = {call.text};"] if call.entry != "start" else []
        if not call.moves and not call.kept:
            return []
        state = [f"m->state = {out}.{call.moves};"] if call.moves else []
        kept = [f"m->in_{each} = {out}.{each};" for each in call.kept]
        return [f"{out} = {call.text};", *state, *kept]

    def _moved(self) -> list[str]:
        tables = [
            f"    m->state.{table.path} = m->store.{table.name};" for table in self.written.changed
        ]
        return ["void model_moved(Model *m)", "{", *tables, "    (void)m;", "}"]

    def _at(self) -> list[str]:
        lines = ["double *model_at(Model *m, unsigned int reference)", "{",
                 "    switch (reference) {"]  # fmt: skip
        for number, variable in enumerate(self.face.variables, 1):
            path = variable.path
            if variable.whole:
                path = f"whole[{self.wholes.index(variable)}]"
            lines += [f"    case {number}:", f"        return &m->{path};"]
        return [*lines, "    default:", "        return NULL;", "    }", "}"]
