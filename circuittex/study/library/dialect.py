"""What differs between the programs that read a library: how each of them writes a choice, a parameter, a source.

ngspice and gnucap run in the tests; LTspice and Xyce are written after their manuals, and checked against these.
"""

from __future__ import annotations

from circuittex.base.frozen import frozen


@frozen
class Dialect:
    """How one program wants what the others write otherwise."""

    name: str
    """'ngspice', 'ltspice', 'xyce' or 'gnucap'."""
    choice: str
    """A choice by a condition, with the fields `if_`, `then` and `other`."""
    expression: str
    """A behavioural source's expression, with the field `of`; empty where there are no such sources."""
    parameters: str
    """What stands before the parameters of a `.subckt` card."""
    temperature: str
    """The simulator's temperature in C in an expression."""

    def choose(self, if_: str, then: str, other: str) -> str:
        """An expression that is `then` or `other`.

        >>> DIALECTS["ltspice"].choose("x<1", "a", "b")
        'if(x<1,a,b)'
        """
        return self.choice.format(if_=if_, then=then, other=other)


DIALECTS = {
    dialect.name: dialect
    for dialect in (
        Dialect("ngspice", "({if_} ? {then} : {other})", "{of}", "", "temper"),
        Dialect("ltspice", "if({if_},{then},{other})", "{of}", "", "temp"),
        Dialect("xyce", "IF({if_},{then},{other})", "{{{of}}}", "PARAMS: ", "TEMP"),
        Dialect("gnucap", "if({if_},{then},{other})", "", "", ""),
    )
}
"""The programs by name. Only Xyce's manual asks for `PARAMS:`, at which other readers stop."""
