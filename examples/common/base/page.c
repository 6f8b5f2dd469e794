#include "base/page.h"

#include "base/write_error.h"

static const char *const style =
    "body{font:15px/1.5 system-ui,sans-serif;max-width:75em;margin:2em auto;padding:0 1em;color:#222;background:#fff}"
    "h1,h2,h3{line-height:1.2}h2{margin-top:2.5em;border-bottom:1px solid #ccc}"
    "table{border-collapse:collapse;margin:1em 0;font-size:14px}th,td{padding:.25em .7em;border-bottom:1px solid #ddd;"
    "text-align:right}th{background:#f2f2f2}th:first-child,td:first-child{text-align:left}"
    "figure{display:inline-block;margin:.5em 1em 1em 0;vertical-align:top}figcaption{color:#666;font-size:13px}"
    "img{max-width:100%;border:1px solid #ddd}code{font-size:12.5px;color:#555;overflow-wrap:anywhere}"
    ".failed{color:#fff;background:#b00020;padding:.4em .7em}";

void page_escape(FILE *file, const char *text)
{
    for (; *text; ++text) {
        switch (*text) {
        case '&': fputs("&amp;", file); break;
        case '<': fputs("&lt;", file); break;
        case '>': fputs("&gt;", file); break;
        case '"': fputs("&quot;", file); break;
        case '\'': fputs("&#39;", file); break;
        default: fputc((unsigned char)*text < ' ' && *text != '\n' && *text != '\t' ? '?' : *text, file);
        }
    }
}

/* Writes <tag attribute>text</tag>. */
static void element(const struct page *page, const char *tag, const char *attribute, const char *text)
{
    fprintf(page->file, "<%s%s>", tag, attribute);
    page_escape(page->file, text);
    fprintf(page->file, "</%s>\n", tag);
}

bool page_open(struct page *page, const char *path, const char *title)
{
    page->path = path;
    page->file = fopen(path, "w");
    if (!page->file) {
        return false;
    }
    fputs("<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
          "<meta name=\"viewport\" content=\"width=device-width\">\n", page->file);
    element(page, "title", "", title);
    fprintf(page->file, "<style>%s</style></head><body>\n", style);
    page_heading(page, 1, title);
    return true;
}

bool page_close(struct page *page)
{
    fputs("</body></html>\n", page->file);
    bool good = !ferror(page->file);
    good = fclose(page->file) == 0 && good;
    if (!good) { partial_file_remove(page->path); }
    return good;
}

void page_heading(struct page *page, int level, const char *text)
{
    static const char *const tags[] = {"h1", "h2", "h3"};
    element(page, tags[level - 1], "", text);
}

void page_text(struct page *page, const char *text) { element(page, "p", "", text); }
void page_failure(struct page *page, const char *text) { element(page, "p", " class=\"failed\"", text); }

void page_code(struct page *page, const char *text)
{
    fputs("<p>", page->file);
    element(page, "code", "", text);
    fputs("</p>\n", page->file);
}

void page_table_begin(struct page *page) { fputs("<table>\n", page->file); }
void page_table_end(struct page *page) { fputs("</table>\n", page->file); }

void page_row(struct page *page, bool is_head, const char *const *cells, int count)
{
    fputs("<tr>", page->file);
    for (int c = 0; c < count; ++c) {
        element(page, is_head ? "th" : "td", "", cells[c]);
    }
    fputs("</tr>\n", page->file);
}

void page_picture(struct page *page, const char *source, const char *caption)
{
    fputs("<figure><a href=\"", page->file);
    page_escape(page->file, source);
    fputs("\"><img src=\"", page->file);
    page_escape(page->file, source);
    fputs("\" alt=\"", page->file);
    page_escape(page->file, caption);
    fputs("\"></a>\n", page->file);
    element(page, "figcaption", "", caption);
    fputs("</figure>\n", page->file);
}
