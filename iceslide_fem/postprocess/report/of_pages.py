"""Pages of several results of any kind: their tables beside each other, their curves together."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from iceslide_fem.postprocess.report.page import (
    OPTIONS,
    SCENES,
    Cell,
    Chart,
    Curve,
    HeatMap,
    Page,
    Part,
    Section,
    Table,
    Text,
)
from iceslide_fem.scene.nested import beside, different

CELSIUS, SECONDS = "°C", "seconds"  # whose percent mean nothing
_NUMBER = re.compile(r"([+-]?\d+(?:\.\d*)?(?:e[+-]?\d+)?)(.*)", re.DOTALL)


def page_of_pages(pages: Mapping[str, Page], command: str) -> Page:
    """Page that compares pages with the first one, by their names; command: what makes it again."""
    first = next(iter(pages))
    stopped = [f"{name}: {page.stopped}" for name, page in pages.items() if page.stopped]
    sections = [Section("scenes", "In what they differ", [table]) for table in _different(pages)]
    sections.append(Section("results", f"Results, against {first}", _tables(pages)))
    if drawn := _drawn(pages):
        sections.append(Section("curves", "Curves and maps", drawn))
    sections += [
        Section("warnings", "Warnings", _texts(pages, "warnings")),
        Section("again", "Run them again", [Text(command, "code"), *_again(pages)]),
    ]
    return Page(
        title=" against ".join(pages) if len(pages) == 2 else f"{len(pages)}: {', '.join(pages)}",
        summary="; ".join(f"{name}: {page.title}" for name, page in pages.items()) + ".",
        stopped=" ".join(stopped),
        sections=sections,
    )


def _parts(page: Page, name: str) -> Sequence[Part]:
    """Parts of the page's section of this name; empty without it."""
    return next((section.parts for section in page.sections if section.name == name), ())


def _texts(pages: Mapping[str, Page], section: str) -> list[Text]:
    return [
        Text(f"{name}: {part.words}", part.kind)
        for name, page in pages.items()
        for part in _parts(page, section)
        if isinstance(part, Text)
    ]


def _different(pages: Mapping[str, Page]) -> list[Table | Text]:
    """Options and keys of scenes that are not the same in all; none where a page does not say
    them.
    """
    of_page: list[dict[str, str]] = [{} for _ in pages]
    for found, page in zip(of_page, pages.values(), strict=True):
        for part in (*_parts(page, "again"), *_parts(page, "scene")):
            if isinstance(part, Table) and part.caption in (OPTIONS, SCENES):
                found |= {row[0].text: row[1].text for row in part.rows}
    if not all(of_page):
        return []
    rows = [
        [Cell(key), *(Cell("–" if text is None else text) for text in texts)]
        for key, texts in different(of_page).items()
    ]
    if not rows:
        return [Text("All of them have the same options.")]
    return [Table("Options and keys", ["", *pages], rows)]


def _tables(pages: Mapping[str, Page]) -> list[Part]:
    """Tables of results by their captions: columns side by side, or rows one below the other."""
    by_caption: dict[str, dict[str, Table]] = {}
    for name, page in pages.items():
        for part in _parts(page, "results"):
            if isinstance(part, Table):
                by_caption.setdefault(part.caption, {})[name] = part
    return [
        _side_by_side(caption, tables)
        if all(len(table.head) == 2 for table in tables.values())
        else _one_below_the_other(caption, tables)
        for caption, tables in by_caption.items()
    ]


def _side_by_side(caption: str, tables: Mapping[str, Table]) -> Table:
    """A column for each page, with percent of the first one where both are numbers."""
    columns = [{row[0].text: row[1].text for row in table.rows} for table in tables.values()]
    rows = []
    for label, found in beside(columns).items():
        texts = ["–" if text is None else text for text in found]
        rows.append([Cell(label), *(_against(text, texts[0], label) for text in texts)])
    return Table(caption, ["", *tables], rows)


def _one_below_the_other(caption: str, tables: Mapping[str, Table]) -> Table:
    """The rows of all pages, with percent of the same row of the first one."""
    first = next(iter(tables.values()))
    rows = []
    for name, table in tables.items():
        alike = table.head == first.head and len(table.rows) == len(first.rows)
        for row, other in zip(table.rows, first.rows if alike else table.rows, strict=True):
            parts = zip(row, other, table.head, strict=True)
            cells = (_against(cell.text, there.text, label) for cell, there, label in parts)
            rows.append([Cell(name), *cells])
    return Table(caption, ["", *first.head], rows)


def _against(text: str, first: str, label: str) -> Cell:
    """The text with its difference in percent, if both are different numbers of one unit."""
    here, there = _NUMBER.fullmatch(text), _NUMBER.fullmatch(first)
    if text == first or CELSIUS in f"{label}{text}" or label == SECONDS:
        return Cell(text)
    if here is None or there is None:
        return Cell(text)
    if here[2] != there[2] or not float(there[1]):
        return Cell(text)
    return Cell(f"{text} ({float(here[1]) / float(there[1]) - 1.0:+.1%})")


def _drawn(pages: Mapping[str, Page]) -> list[Part]:
    """Curves of charts with one name together; maps one after the other."""
    charts: dict[str, dict[str, Chart]] = {}
    maps: list[Part] = []
    for number, (name, page) in enumerate(pages.items()):
        for part in (part for section in page.sections for part in section.parts):
            if isinstance(part, Chart):
                charts.setdefault(part.name, {})[name] = part
            elif isinstance(part, HeatMap):
                title = f"{part.title}: {name}"
                maps.append(part._replace(name=f"{part.name}-{number}", title=title))
    return [*map(_together, charts.values()), *maps]


def _together(charts: Mapping[str, Chart]) -> Chart:
    """One chart with the curves of all."""
    first = next(iter(charts.values()))
    curves: list[Curve] = []
    for name, chart in charts.items():
        for curve in chart.curves:
            own = curve.name if len(chart.curves) > 1 else ""
            label = f"{name}: {own}" if own else name
            curves.append(curve._replace(name=label, look=len(curves)))
    said = {name: chart.says.rstrip(".") for name, chart in charts.items()}
    alike = len(set(said.values())) == 1
    says = first.says if alike else "; ".join(f"{name}: {each}" for name, each in said.items())
    return first._replace(curves=curves, bands=(), says=says)


def _again(pages: Mapping[str, Page]) -> list[Part]:
    """What made each page."""
    found: list[Part] = []
    for name, page in pages.items():
        code = [part for part in _parts(page, "again") if getattr(part, "kind", "") == "code"]
        if code:
            found += [Text(f"{name}:"), *code]
    return found
