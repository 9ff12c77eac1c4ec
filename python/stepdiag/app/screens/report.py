"""Report: the details of a certificate, and the page or PDF to hand over."""

from starlette.responses import HTMLResponse

from stepdiag.app.frame import address, page
from stepdiag.book.book import Entry, MachineFolder
from stepdiag.config.report_keys import LONGEST
from stepdiag.presentation.page.html import element

# Name of the field -> label, and what machine.toml calls it.
FIELDS = {
    "number": ("Number of the report", None),
    "customer": ("Customer", "customer"),
    "machine_type": ("Maker and type of the machine", "title"),
    "serial_number": ("Serial number", "serial_number"),
    "operator": ("Who measured", None),
    "instrument": ("Instrument, with its serial number", None),
    "certificate": ("Calibration certificate of the instrument", None),
    "conditions": ("Conditions of the measurement", None),
    "signatures": ("Who signs (semicolons between names)", None),
}


def report_screen(machine: MachineFolder, entry: Entry) -> HTMLResponse:
    fields = []
    for name, (label, key) in FIELDS.items():
        known = getattr(machine.about, key) if key else None
        box = element("input", id=name, name=name, value=known or "", maxlength=LONGEST)
        fields.append(element("p", element("label", label, for_=name), box))
    limit = machine.about.limit_um
    value = "" if limit is None else f"{limit:g}"
    box = element("input", id="limit", name="limit", type="number", min="0", step="any", value=value)
    fields.append(element("p", element("label", "Limit of the largest error in the volume, µm", for_="limit"), box))
    before = [one for one in machine.listed("calibrations") if one.kind == "calibration" and one.date < entry.date]
    options = [element("option", "none", value="")]
    options += [element("option", f"{one.name} ({one.date[:10]})", value=one.file) for one in reversed(before)]
    chosen = element("select", *options, id="before", name="before")
    fields.append(element("p", element("label", "Before and after: earlier calibration", for_="before"), chosen))
    languages = [element("option", words, value=code) for code, words in (("en", "English"), ("de", "Deutsch"))]
    chosen = element("select", *languages, id="language", name="language")
    fields.append(element("p", element("label", "Language of the report", for_="language"), chosen))
    form = element(
        "form",
        *fields,
        element(
            "p",
            element("button", "Make the page (HTML)", class_="main", name="ending", value=".html"),
            " ",
            element("button", "Make the PDF", name="ending", value=".pdf"),
        ),
        element("input", type="hidden", name="file", value=entry.file),
        method="post",
        action=address(machine.name, "reports"),
        class_="fields",
    )
    return page(
        f"Report of {entry.name}",
        form,
        command=("report", "--machine", machine.name, entry.name, "-o", "report.html"),
        path=[(address(machine.name), machine.name), (address(machine.name, "calibration", entry.name), entry.name)],
    )
